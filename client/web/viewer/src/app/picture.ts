import type { App } from "./app.js";
import { legendCanvas } from "./legend.js";
import { placeOf } from "./sides.js";

/** The panes as they are on the page: with the legend, and with p for each if there are two. */
export function pictureOf(app: App): HTMLCanvasElement {
  const { panes } = app;
  const pictures = panes.map(({ stage }) => stage.picture());
  const { width, height } = pictures[0]!;
  const ratio = width / panes[0]!.stage.width;
  const [across, down] = placeOf("second") === "lower" ? [0, 1] : [1, 0];
  const canvas = document.createElement("canvas");
  canvas.width = width + across * (pictures[1]?.width ?? 0);
  canvas.height = height + down * (pictures[1]?.height ?? 0);
  const context = canvas.getContext("2d")!;
  const { backgroundColor, color } = getComputedStyle(document.body);
  context.fillStyle = backgroundColor;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = color;
  context.font = `600 ${16 * ratio}px system-ui, sans-serif`;
  context.textAlign = "right";
  pictures.forEach((picture, k) => {
    const [left, top] = [k * across * width, k * down * height];
    context.drawImage(picture, left, top);
    const label = panes[k]!.element.dataset["label"] ?? "";
    if (pictures.length > 1) context.fillText(label, left + picture.width - 20 * ratio, top + 32 * ratio);
  });
  const legend = legendCanvas(app, ratio);
  if (legend) context.drawImage(legend, 0, canvas.height - legend.height);
  return canvas;
}
