import { leastP, mostP } from "../model/exponent.js";
import { palettes } from "../model/palettes.js";
import { short } from "../model/words.js";
import type { App } from "./app.js";

/** The meaning of the colours. */
export function legendOf(app: App): { title: string; low: string; middle: string; high: string } | undefined {
  switch (app.view.now.colourBy) {
    case "distortion":
      if (app.red === 0) return { title: "Distortion", low: "none", middle: "", high: "" };
      return { title: "Distortion", low: "0", middle: short(app.red / 2), high: `≥ ${short(app.red)}` };
    case "p":
      return { title: "p", low: short(leastP), middle: short(Math.sqrt(leastP * mostP)), high: short(mostP) };
    case "stiffness":
      return { title: "Stiffness", low: "0.01", middle: "1", high: "100" };
    default:
      return undefined;
  }
}

/** The legend for a picture that has `ratio` pixels for one of the page's. */
export function legendCanvas(app: App, ratio: number): HTMLCanvasElement | undefined {
  const all = legendOf(app);
  if (!all) return undefined;
  const canvas = document.createElement("canvas");
  canvas.width = 264 * ratio;
  canvas.height = 76 * ratio;
  const context = canvas.getContext("2d")!;
  context.scale(ratio, ratio);
  context.fillStyle = getComputedStyle(document.body).color;
  context.font = "600 12px system-ui, sans-serif";
  context.fillText(all.title, 24, 20);
  const colours = context.createLinearGradient(24, 0, 240, 0);
  const { stops } = palettes[app.view.now.palette];
  stops.forEach(([r, g, b], k) => colours.addColorStop(k / (stops.length - 1), `rgb(${r}, ${g}, ${b})`));
  context.font = "11px system-ui, sans-serif";
  [all.low, all.middle, all.high].forEach((text, k) => {
    context.textAlign = (["left", "center", "right"] as const)[k]!;
    context.fillText(text, 24 + 108 * k, 58);
  });
  context.fillStyle = colours;
  context.fillRect(24, 28, 216, 12);
  return canvas;
}
