import type { App } from "../app/app.js";
import type { Status } from "../link/status.js";
import { percent } from "../model/words.js";
import { el, setText } from "./dom.js";

/** The state of the connection and, while a solve is waited for, what is left of it. */
export function statusPill(app: App): { element: HTMLElement; show: (status: Status) => void } {
  const text = el("span");
  // Not part of what a screen reader is told with every change.
  const left = el("span", { className: "left", aria: { hidden: "true" } });
  const element = el("div", { className: "pill", role: "status" }, text, left);
  let status = app.facts.now.status;
  const show = (now: Status) => {
    status = now;
    const { solving } = app.facts.now;
    const isSolving = status.kind === "live" && typeof solving === "object";
    element.dataset["kind"] = status.kind;
    element.dataset["solving"] = status.kind !== "live" || !solving ? "" : isSolving ? "yes" : "ended";
    setText(
      text,
      status.kind === "live" ? { yes: "Solving", ended: "Settled", "": "Live" }[element.dataset["solving"]]! : words(status),
    );
    setText(left, isSolving && solving.left < 1 ? `${percent(solving.left)} left` : "");
    element.style.setProperty("--done", String(isSolving ? 1 - solving.left : 0));
  };
  app.facts.watch(
    ({ solving }) => [solving],
    () => show(status),
  );
  return { element, show };
}

function words({ kind, title }: Status): string {
  return kind === "idle" || kind === "opening" ? "Preparing…" : title;
}
