import type { App } from "../app/app.js";
import { legendOf } from "../app/legend.js";
import { gradientOf } from "../model/palettes.js";
import { el, setText } from "./dom.js";
import { icon } from "./icons.js";

/** The scale at the lower left, with a pin that keeps it. */
export function legend(app: App): HTMLElement {
  const title = el("span", { className: "legend-title" });
  const numbers = [el("span"), el("span"), el("span")] as const;
  const pin = el(
    "button",
    {
      type: "button",
      className: "icon-button small",
      title: "Pin the scale, to compare (P)",
      aria: { label: "Pin the scale" },
    },
    icon("pin"),
  );
  pin.addEventListener("click", () => app.togglePin());
  const bar = el("div", { className: "legend-bar" });
  const element = el(
    "aside",
    { className: "legend" },
    el("div", { className: "legend-head" }, title, pin),
    bar,
    el("div", { className: "legend-numbers" }, ...numbers),
  );
  const show = () => {
    const all = legendOf(app);
    element.hidden = all === undefined;
    pin.hidden = app.view.now.colourBy !== "distortion";
    if (!all) return;
    setText(title, all.title);
    setText(numbers[0], all.low);
    setText(numbers[1], all.middle);
    setText(numbers[2], all.high);
  };
  app.view.watchAll(show);
  app.view.watch(
    ({ pinned }) => [pinned],
    ([pinned]) => pin.setAttribute("aria-pressed", String(pinned !== undefined)),
  );
  app.view.watch(
    ({ palette }) => [palette],
    ([palette]) => (bar.style.background = gradientOf(palette)),
  );
  app.afterDrawing.add(show);
  return element;
}
