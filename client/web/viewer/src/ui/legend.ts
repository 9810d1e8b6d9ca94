import type { App } from "../app/app.js";
import { stops } from "../model/colours.js";
import { el, setText, short } from "./dom.js";
import { icon } from "./icons.js";

const gradient = stops.map(([r, g, b]) => `rgb(${r}, ${g}, ${b})`).join(", ");

/** What the colours mean. */
function ends(app: App): { title: string; low: string; middle: string; high: string } | undefined {
  switch (app.view.now.colourBy) {
    case "distortion":
      if (app.red === 0) return { title: "Distortion", low: "none", middle: "", high: "" };
      return { title: "Distortion", low: "0", middle: short(app.red / 2), high: `≥ ${short(app.red)}` };
    case "p":
      return { title: "p", low: "1", middle: "3.2", high: "10" };
    case "stiffness":
      return { title: "Stiffness", low: "0.01", middle: "1", high: "100" };
    default:
      return undefined;
  }
}

/** The scale at the lower left, with a pin that keeps it as it is. */
export function legend(app: App): HTMLElement {
  const title = el("span", { className: "legend-title" });
  const numbers = [el("span"), el("span"), el("span")] as const;
  const pin = el("button", { type: "button", className: "icon-button small", title: "Pin the scale, to compare (P)", aria: { label: "Pin the scale" } }, icon("pin"));
  pin.addEventListener("click", () => togglePin(app));
  const bar = el("div", { className: "legend-bar", style: `background: linear-gradient(90deg, ${gradient})` });
  const element = el("aside", { className: "legend" }, el("div", { className: "legend-head" }, title, pin), bar, el("div", { className: "legend-numbers" }, ...numbers));
  const show = () => {
    const all = ends(app);
    element.hidden = all === undefined;
    pin.hidden = app.view.now.colourBy !== "distortion";
    pin.setAttribute("aria-pressed", String(app.view.now.pinned !== undefined));
    if (!all) return;
    setText(title, all.title);
    setText(numbers[0], all.low);
    setText(numbers[1], all.middle);
    setText(numbers[2], all.high);
  };
  app.view.watch(show);
  app.afterDrawing.add(show);
  return element;
}

export function togglePin(app: App): void {
  app.view.set({ pinned: app.view.now.pinned === undefined && app.red > 0 ? app.red : undefined });
}

/** The same for a picture, `ratio` pixels for one of the page's. */
export function legendCanvas(app: App, ratio: number): HTMLCanvasElement | undefined {
  const all = ends(app);
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
