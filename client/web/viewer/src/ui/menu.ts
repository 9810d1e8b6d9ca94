import { el } from "./dom.js";

/** A button that opens a short list of actions. */
export function menu(
  picture: Node,
  label: string,
  title: string,
  actions: readonly (readonly [string, () => void])[],
): HTMLElement {
  const opener = el(
    "button",
    { type: "button", className: "icon-button labelled", title, aria: { haspopup: "menu", expanded: "false", label } },
    picture,
    el("span", {}, label),
  );
  const list = el("div", { className: "menu", role: "menu", hidden: true });
  const show = (isOpen: boolean) => {
    list.hidden = !isOpen;
    opener.setAttribute("aria-expanded", String(isOpen));
    if (isOpen) (list.firstElementChild as HTMLElement).focus();
  };
  for (const [text, act] of actions) {
    const item = el("button", { type: "button", role: "menuitem", textContent: text });
    item.addEventListener("click", () => {
      show(false);
      act();
    });
    list.append(item);
  }
  opener.addEventListener("click", () => show(list.hidden !== false));
  const element = el("div", { className: "menu-holder" }, opener, list);
  element.addEventListener("focusout", (event) => {
    if (!element.contains(event.relatedTarget as Node | null)) show(false);
  });
  element.addEventListener("keydown", (event) => {
    const items = [...list.children] as HTMLElement[];
    const at = items.indexOf(document.activeElement as HTMLElement);
    if (event.key === "Escape") {
      show(false);
      opener.focus();
    } else if (event.key === "ArrowDown") items[(at + 1) % items.length]!.focus();
    else if (event.key === "ArrowUp") items[(at + items.length - 1) % items.length]!.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return element;
}
