import type { App } from "../app/app.js";
import { remember, remembered } from "../io/remember.js";
import { el, toggle } from "./dom.js";

const singleKeys = "lpdeform-single-keys";

const sections: readonly (readonly [string, readonly (readonly [string, string])[]])[] = [
  [
    "Tools",
    [
      ["1", "Move: drag a handle, click or tap the surface for a new one"],
      ["2", "Brush: paint a handle"],
      ["3  4", "Lasso, box: draw around vertices"],
      ["5", "p brush: paint p or stiffness"],
      ["E", "The p brush, and then what it does: paint, erase, smooth"],
      ["[  ]", "Smaller, larger brush"],
      ["Y", "Work on both sides of a plane across x, y, z, or on one side"],
      ["Shift", "with a stroke: add to the selected handle"],
      ["Alt", "with a stroke: release vertices"],
    ],
  ],
  [
    "Handles",
    [
      ["T  R  Z", "Arrows, rings, cubes on the selected handle: move, turn, scale it"],
      ["X", "Their axes: of the mesh, of the handle, of the picture"],
      ["M", "Keep to a grid, or to vertices, while dragging"],
      ["Enter", "A cross in the picture: arrows move it, Enter places a handle"],
      ["N", "Select the next handle"],
      ["Ctrl", "with a click on a handle: select it, too; they move together"],
      ["Ctrl+A", "Select all that are not locked"],
      ["← → ↑ ↓", "Move it by steps, Page Up and Page Down along z; with rings, turn it; with cubes, scale it"],
      ["Delete", "Delete it"],
      ["K", "Keep the present pose, in the panel “Poses”"],
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
      ["B", "Look from the front, right, top, back, left, bottom"],
      ["Q", "Without perspective"],
      ["W  G", "Wireframe, the original as a ghost"],
      ["C", "Next colours"],
      ["V", "Values of the vertex under the pointer or the cross"],
      ["P", "Pin the colours' scale"],
      ["D", "Dark or light"],
      ["I", "The side panel"],
      ["O", "Open a file"],
      ["Ctrl+S", "Save the project: mesh, handles, fields, settings, camera"],
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
  const close = el("button", { type: "button", className: "plain", textContent: "Close" });
  const sheet = el(
    "dialog",
    { className: "help", aria: { label: "Help" } },
    el("h2", { tabIndex: -1, autofocus: true }, "Deform a shape"), // what can be pressed may be below what is seen
    el(
      "p",
      {},
      "Handles hold parts of the surface. Drag one and everything between them follows, with the least Lₚ distortion: low p gathers it in creases, high p spreads it. " +
        "The legend tells the colours, from undistorted to most distorted. Drag beside the shape to turn it, scroll or pinch to zoom, right-drag or two fingers to shift. On a touch screen one finger works the tool, two the view.",
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
