import type { App } from "../app/app.js";
import { remember, remembered } from "../io/remember.js";
import { el, toggle } from "./dom.js";

const singleKeys = "lpdeform-single-keys";

const sections: readonly (readonly [string, readonly (readonly [string, string])[]])[] = [
  [
    "Tools",
    [
      ["1", "Move: drag a handle, click the surface for a new one"],
      ["2", "Brush: paint a handle"],
      ["3  4", "Lasso, box: draw around vertices"],
      ["5", "p brush: paint p or stiffness"],
      ["[  ]", "Smaller, larger brush"],
      ["Shift", "with a stroke: add to the selected handle"],
      ["Alt", "with a stroke: release vertices"],
    ],
  ],
  [
    "Handles",
    [
      ["T  R", "Arrows, rings on the selected handle"],
      ["Enter", "A cross in the picture: arrows move it, Enter places a handle"],
      ["N", "Select the next handle"],
      ["← → ↑ ↓", "Move it by steps, Page Up and Page Down along z; with rings, turn it"],
      ["Delete", "Delete it"],
      ["L", "Lock it against dragging"],
      ["Ctrl+Z", "Undo; Ctrl+Shift+Z redo"],
    ],
  ],
  [
    "p",
    [
      [", .", "Lower, raise p"],
      ["A", "Automatic p"],
      ["S", "Two values of p side by side"],
    ],
  ],
  [
    "View",
    [
      ["Space", "held: dragging turns the view"],
      ["Ctrl+← →", "Turn the view; with Shift, shift it"],
      ["+  -", "Zoom"],
      ["F", "Show all of it"],
      ["W  G", "Wireframe, the original as a ghost"],
      ["C", "Next colours"],
      ["P", "Pin the colours' scale"],
      ["D", "Dark or light"],
      ["I", "The side panel"],
      ["O", "Open a file"],
      ["?", "This help"],
    ],
  ],
];

/** The help sheet; Escape closes it. */
export function helpSheet(app: App): HTMLDialogElement {
  app.view.set({ hasSingleKeys: remembered(singleKeys) !== "off" });
  const single = toggle(
    "Shortcuts of a single key",
    app.view.now.hasSingleKeys,
    (isOn) => {
      app.view.set({ hasSingleKeys: isOn });
      remember(singleKeys, isOn ? "on" : "off");
    },
    "Letters, digits and signs: off for speech input and for whoever hits keys by mistake",
  );
  const close = el("button", { type: "button", className: "plain", textContent: "Close", autofocus: true });
  const sheet = el(
    "dialog",
    { className: "help", aria: { label: "Help" } },
    el("h2", {}, "Deform a shape"),
    el(
      "p",
      {},
      "Handles hold parts of the surface. Drag one and everything between them follows, with the least Lₚ distortion: low p gathers it in creases, high p spreads it. " +
        "Blue is undistorted, red most distorted. Drag beside the shape to turn it, scroll or pinch to zoom, right-drag or two fingers to shift. On a touch screen one finger works the tool, two the view.",
    ),
    el(
      "div",
      { className: "sections" },
      ...sections.map(([title, rows]) =>
        el(
          "section",
          {},
          el("h3", {}, title),
          el(
            "dl",
            {},
            ...rows.flatMap(([keys, text]) => [
              el("dt", {}, ...keys.split("  ").map((key) => el("kbd", {}, key))),
              el("dd", {}, text),
            ]),
          ),
        ),
      ),
    ),
    single.element,
    close,
  );
  close.addEventListener("click", () => sheet.close());
  sheet.addEventListener("click", (event) => {
    if (event.target === sheet) sheet.close();
  });
  return sheet;
}
