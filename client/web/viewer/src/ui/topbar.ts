import type { App } from "../app/app.js";
import type { Files } from "../app/files.js";
import { type Detail, shapeKinds } from "../model/shapes.js";
import { el, setText } from "./dom.js";
import { icon, type IconName } from "./icons.js";
import { menu } from "./menu.js";
import { button } from "./controls.js";
import { shareLink } from "./share.js";
import { toolRail } from "./toolbar.js";

/** The name, opening, undo, actions on the whole work, and the tools. */
export function topbar(app: App, files: Files, showHelp: () => void): HTMLElement {
  const shapes = el("select", { title: "A shape to begin with", aria: { label: "Shape" } });
  for (const { id, title } of shapeKinds) shapes.append(el("option", { value: id, textContent: title }));
  const own = el("option", { value: "", hidden: true });
  shapes.append(own);
  const details = el("select", { title: "How many vertices the shape has", aria: { label: "Detail" } });
  for (const [value, text] of [
    ["coarse", "coarse"],
    ["medium", "medium"],
    ["fine", "fine, 10,000"],
  ]) {
    details.append(el("option", { value: value!, textContent: text! }));
  }
  const openShape = () => app.openShape(shapes.value || "bar", details.value as Detail);
  shapes.addEventListener("change", openShape);
  details.addEventListener("change", openShape);

  const undo = button("undo", "Undo (Ctrl+Z)", () => app.undo());
  const redo = button("redo", "Redo (Ctrl+Shift+Z)", () => app.redo());
  const split = button("split", "Two values of p side by side (S)", () => app.view.set({ isSplit: !app.view.now.isSplit }));
  const theme = button("moon", "Dark or light (D)", () => app.view.set({ isDark: !app.view.now.isDark }));
  const panel = button("panel", "Side panel (I)", () => app.view.set({ isPanelOpen: !app.view.now.isPanelOpen }));
  const open = labelled(
    "open",
    "Open",
    "A mesh (GLB, glTF, OFF, OBJ, PLY, STL, FBX, DAE, 3MF), a project, or a handle file; dropping it onto the page does the same (O)",
    () => files.choose(),
  );

  app.facts.watch(
    ({ canUndo, canRedo, mesh }) => [canUndo, canRedo, mesh],
    ([canUndo, canRedo, mesh]) => {
      undo.disabled = !canUndo;
      redo.disabled = !canRedo;
      setText(own, mesh.name);
    },
  );
  app.view.watchAll((view) => {
    own.hidden = view.shape !== "";
    shapes.value = view.shape;
    details.value = view.detail;
    details.hidden = view.shape === "";
    split.setAttribute("aria-pressed", String(view.isSplit));
    panel.setAttribute("aria-pressed", String(view.isPanelOpen));
    theme.replaceChildren(icon(view.isDark ? "sun" : "moon"));
  });
  return el(
    "header",
    { className: "topbar" },
    title(),
    el("div", { className: "cluster" }, shapes, details),
    open,
    el("div", { className: "cluster" }, undo, redo),
    el("span", { className: "space" }),
    split,
    exportMenu(app, files),
    theme,
    button("help", "Help and shortcuts (?)", showHelp),
    panel,
    toolRail(app),
  );
}

function exportMenu(app: App, files: Files): HTMLElement {
  return menu(icon("save"), "Save", "Save or export", [
    ["Project, to go on with (Ctrl+S)", () => void files.saveProject()],
    ["Mesh as PLY, with distortion", () => void files.exportMesh("ply")],
    ["Mesh as GLB", () => void files.exportMesh("glb")],
    ["Mesh as OBJ", () => void files.exportMesh("obj")],
    ["Mesh as OFF", () => void files.exportMesh("off")],
    ["Mesh as STL", () => void files.exportMesh("stl")],
    ["Picture as PNG", () => files.exportPicture()],
    ["Poses as GLB, with morph targets", () => void files.exportPoses("glb")],
    ["Poses as video", () => void files.exportPoses("video")],
    ["Handles as JSON", () => files.saveHandles()],
    ["Link to watch live", () => shareLink(app)],
  ]);
}

function labelled(name: IconName, text: string, title: string, pressed: () => void): HTMLButtonElement {
  const element = button(name, title, pressed);
  element.classList.add("labelled");
  element.append(el("span", {}, text));
  element.setAttribute("aria-label", text);
  return element;
}

/** The name of the page. */
export function title(): HTMLElement {
  return el("h1", { aria: { label: "lpdeform" } }, logo(), el("span", {}, "lpdeform"));
}

function logo(): Node {
  const template = document.createElement("template");
  template.innerHTML =
    '<svg class="logo" viewBox="0 0 32 32" aria-hidden="true"><path class="rest" d="M9 27V5"/><path class="bent" d="M9 27V17c0-6 4-10 12-11"/><circle class="held" cx="9" cy="27" r="3"/><circle class="pulled" cx="22" cy="6" r="3.500"/></svg>';
  return template.content.firstChild!;
}
