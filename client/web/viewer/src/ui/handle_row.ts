import type { App } from "../app/app.js";
import { groupColours } from "../model/colours.js";
import { changeHandle, type Handle, nameFault, removeHandle } from "../model/document.js";
import { selecting, toggled } from "../model/together.js";
import { short } from "../model/words.js";
import { button } from "./controls.js";
import { el, setText } from "./dom.js";
import { icon } from "./icons.js";

export interface HandleRow {
  element: HTMLElement;
  show(handle: Handle, isSelected: boolean, isTogether: boolean): void;
}

/** A line of the list: colour, link, name, count, padlock, bin. It stays when its contents change, so it keeps the focus. */
export function handleRow(app: App): HandleRow {
  let shown: Handle | undefined;
  const change = (part: (handle: Handle) => Partial<Handle>) =>
    app.change(changeHandle(app.document, shown!.name, part(shown!)));
  const dot = el("button", { type: "button", className: "dot", title: "Next colour" });
  dot.addEventListener("click", () =>
    change(({ colour }) => ({ colour: groupColours[(groupColours.indexOf(colour) + 1) % groupColours.length]! })),
  );
  const field = el("input", { className: "name", spellcheck: false, aria: { label: "Name" } });
  field.addEventListener("focus", () => app.view.set(selecting(app.view.now, shown!.name)));
  field.addEventListener("change", () => rename(app, shown!.name, field));
  const together = button("together", "", () => {
    if (together.ariaDisabled !== "true") app.view.set(toggled(app.view.now, shown!.name));
  });
  const lock = button("unlock", "", () => change(({ isLocked }) => ({ isLocked: !isLocked })));
  const remove = button("trash", "", () => app.change(removeHandle(app.document, shown!.name)));
  const count = el("span", { className: "count", title: "Vertices" });
  // The link comes before the name: Tab reaches it while another handle is selected.
  const element = el("li", {}, dot, together, field, count, lock, remove);
  element.addEventListener("click", (event) => {
    if (event.ctrlKey || event.metaKey) event.target === element && app.view.set(toggled(app.view.now, shown!.name));
    else if (event.target === element) app.view.set({ selected: shown!.name });
  });

  const show = (handle: Handle, isSelected: boolean, isTogether: boolean) => {
    const { name, colour, vertices, points, isLocked } = handle;
    if (name !== shown?.name) {
      field.value = name;
      element.dataset["handle"] = name;
      dot.setAttribute("aria-label", `Colour of ${name}`);
      entitle(together, `Move ${name} together with the selected handle (Ctrl+click)`);
      entitle(remove, `Delete ${name} (Delete)`);
    }
    if (isLocked !== shown?.isLocked) {
      lock.replaceChildren(icon(isLocked ? "lock" : "unlock"));
      entitle(lock, isLocked ? "Locked: let it move" : "Lock it against dragging");
    }
    dot.style.setProperty("--colour", colour);
    setText(count, points ? `${points.length} pts` : short(vertices.length));
    element.classList.toggle("selected", isSelected || isTogether);
    together.setAttribute("aria-pressed", String(isTogether));
    together.ariaDisabled = String(isSelected && !isTogether); // it keeps the focus that comes over the name
    shown = handle;
  };
  return { element, show };
}

function entitle(element: HTMLElement, title: string): void {
  element.title = title;
  element.setAttribute("aria-label", title);
}

function rename(app: App, name: string, field: HTMLInputElement): void {
  const wanted = field.value.trim();
  const fault = nameFault(app.document, name, wanted);
  if (fault) {
    app.notify(fault, true);
    field.value = name;
  } else if (wanted !== name) {
    app.change(changeHandle(app.document, name, { name: wanted }));
    app.view.set({ selected: wanted });
  }
}
