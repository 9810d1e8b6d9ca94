import type { WhenToShow } from "../app/keeper.js";
import { el } from "./dom.js";

/** Asks when to show work again that may have been too much for the page; Escape puts it off. */
export function wantsBack(name: string): Promise<WhenToShow> {
  const yes = el("button", { type: "button", className: "plain", textContent: "Show it again", autofocus: true });
  const later = el("button", { type: "button", className: "plain", textContent: "Not now" });
  const no = el("button", { type: "button", className: "plain", textContent: "Discard it" });
  const sheet = el(
    "dialog",
    { className: "help question", aria: { label: "Your work" } },
    el("h2", {}, `Show “${name}” again?`),
    el("p", {}, "The page stopped while it was bringing this work back. It may be too large for this browser."),
    el("div", { className: "answers" }, no, later, yes),
  );
  document.body.append(sheet);
  sheet.showModal();
  return new Promise<WhenToShow>((resolve) => {
    yes.addEventListener("click", () => resolve("now"));
    later.addEventListener("click", () => resolve("later"));
    no.addEventListener("click", () => resolve("never"));
    sheet.addEventListener("close", () => resolve("later"));
  }).finally(() => sheet.remove());
}
