import type { App } from "../app/app.js";
import { linkTo } from "../link/watched.js";
import { el, setText } from "./dom.js";

/** Shows the link by which others watch the first picture's session. */
export function shareLink(app: App): void {
  const session = app.panes[0]!.live?.sessionName;
  if (!session) return app.notify("There is a link as soon as the server has the shape.", true);
  const link = el("input", { type: "text", readOnly: true, value: linkTo(session, location.href), aria: { label: "Link" } });
  const copy = el("button", { type: "button", className: "plain", textContent: "Copy the link" });
  const close = el("button", { type: "button", className: "plain", textContent: "Close" });
  const sheet = el(
    "dialog",
    { className: "help share", aria: { label: "Watch live" } },
    el("h2", {}, "Watch live"),
    el(
      "p",
      {},
      "People who open this link see the shape as you change it, and can turn the view. With other programs they can also change the " +
        "shape, so give the link to people whom you trust. The link ends when you open another shape, or ten minutes after the last " +
        "page has left it.",
    ),
    link,
    el("div", { className: "pose-actions" }, copy, close),
  );
  copy.addEventListener("click", () => {
    link.select();
    // Pages that are not from a safe origin have no clipboard, but their users have.
    void (navigator.clipboard?.writeText(link.value) ?? Promise.reject(new Error("no clipboard"))).then(
      () => setText(copy, "Copied"),
      () => setText(copy, "Press Ctrl+C to copy it"),
    );
  });
  close.addEventListener("click", () => sheet.close());
  sheet.addEventListener("close", () => sheet.remove());
  document.querySelector("#app")!.append(sheet);
  sheet.showModal();
  link.select();
}
