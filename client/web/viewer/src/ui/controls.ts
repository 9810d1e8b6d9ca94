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

/** Keys that move a slider; others leave it as it is. */
const sliderKeys = new Set(["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "PageUp", "PageDown", "Home", "End"]);

/** `begun`: called when it is pressed, by the pointer or such a key. `ended`: when it is let go. */
export function slider(
  label: string,
  min: number,
  max: number,
  step: number,
  changed: (value: number) => void,
  ended: () => void = () => undefined,
  begun: () => void = () => undefined,
): { element: HTMLElement; show: (value: number, text: string) => void } {
  const input = el("input", { type: "range", min: String(min), max: String(max), step: String(step), aria: { label } });
  const shown = el("output");
  input.addEventListener("input", () => changed(input.valueAsNumber));
  // A held key changes the value many times; that is a single change.
  input.addEventListener("keydown", ({ key, repeat }) => {
    if (!sliderKeys.has(key)) return;
    if (!repeat) begun();
    input.classList.add("held");
  });
  const end = () => {
    const wasHeld = input.classList.contains("held");
    input.classList.remove("held");
    if (wasHeld) ended();
  };
  input.addEventListener("keyup", ({ key }) => sliderKeys.has(key) && end());
  input.addEventListener("blur", end);
  input.addEventListener("pointerdown", begun);
  input.addEventListener("change", () => input.classList.contains("held") || ended());
  const show = (value: number, text: string) => {
    input.valueAsNumber = value;
    input.style.setProperty("--share", `${((value - min) / (max - min)) * 100}%`);
    input.setAttribute("aria-valuetext", text);
    shown.textContent = text;
  };
  return { element: el("label", { className: "slider" }, el("span", {}, label), input, shown), show };
}
