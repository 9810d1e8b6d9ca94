import type { Encoding } from "lpdeform-client";
import type { App } from "../app/app.js";
import type { ColourBy } from "../model/view.js";
import { choice, el, toggle } from "./dom.js";

/** What is drawn, and how frames are sent. */
export function lookPanel(app: App): HTMLElement {
  const colour = choice<ColourBy>(
    "Colours",
    [
      ["distortion", "Distortion"],
      ["p", "p"],
      ["stiffness", "Stiffness"],
      ["normals", "Normals"],
      ["plain", "Plain"],
    ],
    (colourBy) => app.view.set({ colourBy }),
  );
  const wireframe = toggle("Wireframe", false, (isOn) => app.view.set({ wireframe: isOn }), "The edges (W)");
  const ghost = toggle("Original", false, (isOn) => app.view.set({ ghost: isOn }), "The mesh at rest as a ghost (G)");
  const pin = toggle(
    "Pin scale",
    false,
    (isOn) => app.view.set({ pinned: isOn && app.red > 0 ? app.red : undefined }),
    "Keep the colours' scale as it is (P)",
  );
  const up = toggle("Y is up", false, (isOn) => app.view.set({ isYUp: isOn }), "For meshes whose y axis points up");
  const encoding = el("select", { aria: { label: "How frames are sent" } });
  for (const [value, text] of [
    ["float32", "exact, 16 bytes per vertex"],
    ["quantized", "16 bits, 8 bytes per vertex"],
    ["compressed", "compressed, about 3 bytes"],
  ]) {
    encoding.append(el("option", { value: value!, textContent: text! }));
  }
  encoding.addEventListener("change", () => app.view.set({ encoding: encoding.value as Encoding }));
  app.view.watchAll((view) => {
    colour.show(view.colourBy);
    wireframe.input.checked = view.wireframe;
    ghost.input.checked = view.ghost;
    pin.input.checked = view.pinned !== undefined;
    up.input.checked = view.isYUp;
    encoding.value = view.encoding;
  });
  return el(
    "div",
    { className: "look" },
    colour.element,
    el("div", { className: "toggles" }, wireframe.element, ghost.element, pin.element, up.element),
    el("label", { className: "pair" }, el("span", {}, "Frames"), encoding),
  );
}
