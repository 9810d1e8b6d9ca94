import { el } from "./dom.js";
import { icon, type IconName } from "./icons.js";

export function button(name: IconName, title: string, pressed: () => void): HTMLButtonElement {
  const element = el(
    "button",
    { type: "button", className: "icon-button", title, aria: { label: title } },
    icon(name) as unknown as Node,
  );
  element.addEventListener("click", pressed);
  return element;
}

export function slider(
  label: string,
  min: number,
  max: number,
  step: number,
  changed: (value: number) => void,
  ended: () => void = () => undefined,
): { element: HTMLElement; show: (value: number, text: string) => void } {
  const input = el("input", { type: "range", min: String(min), max: String(max), step: String(step), aria: { label } });
  const shown = el("output");
  input.addEventListener("input", () => changed(input.valueAsNumber));
  // A held key changes the value many times; that is a single change.
  input.addEventListener("keydown", () => input.classList.add("held"));
  for (const end of ["keyup", "blur"]) {
    input.addEventListener(end, () => {
      const wasHeld = input.classList.contains("held");
      input.classList.remove("held");
      if (wasHeld) ended();
    });
  }
  input.addEventListener("change", () => input.classList.contains("held") || ended());
  const show = (value: number, text: string) => {
    input.valueAsNumber = value;
    input.style.setProperty("--share", `${((value - min) / (max - min)) * 100}%`);
    input.setAttribute("aria-valuetext", text);
    shown.textContent = text;
  };
  return { element: el("label", { className: "slider" }, el("span", {}, label), input, shown), show };
}
