import { el } from "./dom.js";

/** Asks whether work is to be shown again that the page perhaps could not bear; Escape says no. */
export function wantsBack(name: string): Promise<boolean> {
  const yes = el("button", { type: "button", className: "plain", textContent: "Show it again" });
  const no = el("button", { type: "button", className: "plain", textContent: "Discard it" });
  const sheet = el(
    "dialog",
    { className: "help", aria: { label: "Your work" } },
    el("h2", {}, `Show “${name}” again?`),
    el("p", {}, "The page stopped while it was bringing this work back. It may be too large for this browser."),
    yes,
    " ",
    no,
  );
  document.body.append(sheet);
  sheet.showModal();
  return new Promise<boolean>((resolve) => {
    yes.addEventListener("click", () => resolve(true));
    no.addEventListener("click", () => resolve(false));
    sheet.addEventListener("close", () => resolve(false));
  }).finally(() => sheet.remove());
}
