type Child = Node | string | undefined | false;

type Attributes<Tag extends keyof HTMLElementTagNameMap> = Partial<
  Omit<HTMLElementTagNameMap[Tag], "style" | "dataset" | "children">
> & {
  style?: string;
  data?: Record<string, string>;
  aria?: Record<string, string>;
};

/** An element with properties (not attributes), data-, aria- and children. */
export function el<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  { style, data, aria, ...properties }: Attributes<Tag> = {},
  ...children: Child[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  Object.assign(element, properties);
  if (style) element.style.cssText = style; // a strict content policy forbids the attribute
  for (const [name, value] of Object.entries(data ?? {})) element.dataset[name] = value;
  for (const [name, value] of Object.entries(aria ?? {})) element.setAttribute(`aria-${name}`, value);
  element.append(...children.filter((child): child is Node | string => child !== undefined && child !== false));
  return element;
}

/** Sets the text if it differs. */
export function setText(element: HTMLElement, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A switch with its label. */
export function toggle(
  label: string,
  isOn: boolean,
  changed: (isOn: boolean) => void,
  title = "",
): { element: HTMLElement; input: HTMLInputElement } {
  const input = el("input", { type: "checkbox", checked: isOn });
  input.addEventListener("change", () => changed(input.checked));
  return {
    element: el("label", { className: "toggle", title }, input, el("span", { className: "track" }), el("span", {}, label)),
    input,
  };
}

/** One of several, as a row of buttons. */
export function choice<Value extends string>(
  label: string,
  options: readonly (readonly [Value, string])[],
  chosen: (value: Value) => void,
): { element: HTMLElement; show: (value: Value) => void } {
  const buttons = options.map(([value, text]) => {
    const button = el("button", { type: "button", textContent: text, data: { value } });
    button.addEventListener("click", () => chosen(value));
    return button;
  });
  const element = el("div", { className: "choice", role: "group", aria: { label } }, ...buttons);
  const show = (value: Value) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset["value"] === value));
  };
  return { element, show };
}

/** Tells the style sheets how high the element is, by a property of the page. */
export function measured<Made extends HTMLElement>(element: Made, property: `--${string}`): Made {
  new ResizeObserver(() => {
    document.documentElement.style.setProperty(property, `${element.offsetHeight}px`);
  }).observe(element);
  return element;
}
