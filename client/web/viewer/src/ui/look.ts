import type { Encoding } from "lpdeform-client";
import type { App } from "../app/app.js";
import { remember, remembered } from "../io/remember.js";
import { type PaletteName, palettes } from "../model/palettes.js";
import type { ColourBy } from "../model/view.js";
import { axisButtons } from "./axis_buttons.js";
import { choice, el, toggle } from "./dom.js";

const paletteKey = "lpdeform-palette";

/** What is drawn, and how frames are sent. */
export function lookPanel(app: App): HTMLElement {
  const colour = choice<ColourBy>(
    "Colours",
    [
      ["distortion", "Distortion"],
      ["p", "p"],
      ["stiffness", "Stiffness"],
      ["normals", "Normals"],
      ["clay", "Clay"],
      ["texture", "Texture"],
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
  const readout = toggle(
    "Values",
    true,
    (isOn) => app.view.set({ hasReadout: isOn }),
    "Distortion and p of the vertex under the pointer, or under the cross (V)",
  );
  const parallel = toggle(
    "Parallel",
    false,
    (isOn) => app.view.set({ isParallel: isOn }),
    "Without perspective: what is farther away is as large (Q)",
  );
  const palette = paletteChoice(app);
  const encoding = el("select", { aria: { label: "How frames are sent" } });
  for (const [value, text] of [
    ["float32", "exact, 16 B a vertex"],
    ["quantized", "16 bits, 8 B a vertex"],
    ["compressed", "compressed, about 3 B"],
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
    readout.input.checked = view.hasReadout;
    parallel.input.checked = view.isParallel;
    encoding.value = view.encoding;
  });
  const texture = colour.element.querySelector<HTMLButtonElement>('[data-value="texture"]')!;
  app.facts.watch(
    ({ mesh }) => [mesh],
    () => {
      texture.disabled = !app.isTextured;
      texture.title = app.isTextured
        ? ""
        : "A GLB or glTF with materials has textures, and an OBJ that is opened together with its MTL and images";
    },
  );
  return el(
    "div",
    { className: "look" },
    colour.element,
    el("div", { className: "toggles" }, ...[wireframe, ghost, pin, up, readout, parallel].map(({ element }) => element)),
    axisButtons(app),
    palette,
    el("label", { className: "pair" }, el("span", {}, "Frames"), encoding),
  );
}

/** The user's last choice is that of the next visit. */
function paletteChoice(app: App): HTMLElement {
  const select = el("select", { aria: { label: "Palette" } });
  const names = Object.keys(palettes) as PaletteName[];
  for (const name of names) select.append(el("option", { value: name, textContent: palettes[name].label }));
  const last = names.find((name) => name === remembered(paletteKey));
  if (last) app.view.set({ palette: last });
  select.addEventListener("change", () => {
    const palette = select.value as PaletteName;
    app.view.set({ palette });
    remember(paletteKey, palette);
  });
  app.view.watch(
    ({ palette }) => [palette],
    ([palette]) => {
      select.value = palette;
      select.title = palettes[palette].title;
    },
  );
  return el("label", { className: "pair" }, el("span", {}, "Palette"), select);
}
