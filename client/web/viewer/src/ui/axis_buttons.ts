import type { App } from "../app/app.js";
import { type AxisView, axisViews } from "../model/axis_views.js";
import { capital } from "../model/words.js";
import { el } from "./dom.js";

const from: Readonly<Record<AxisView, string>> = {
  front: "from the front",
  right: "from its right side",
  top: "from above",
  back: "from the back",
  left: "from its left side",
  bottom: "from below",
};

/** Views along the mesh's axes. */
export function axisButtons(app: App): HTMLElement {
  const buttons = axisViews.map((view) => {
    const text = capital(view);
    const title = `Look at the mesh ${from[view]} (B: the next)`;
    const button = el("button", { type: "button", textContent: text, title });
    button.addEventListener("click", () => app.lookAlong(view));
    return button;
  });
  return el("div", { className: "choice", role: "group", aria: { label: "Look from" } }, ...buttons);
}
