import type { Reason } from "lpdeform-client";
import type { App } from "../app/app.js";
import { pressing, touches } from "../app/touch.js";
import { elementsIn, isPassing, notAnswering, sentence, type Status } from "../link/status.js";
import { capital, percent } from "../model/words.js";
import { el, setText } from "./dom.js";
import { startNotices } from "./notice.js";
import { statusPill } from "./pill.js";
import { pointOutNamed } from "./report.js";

/** How long the server may be away before a message appears. */
const awayMs = 400;

/** Reasons that need no action by the user: they only say that a newer change came. */
const quiet = new Set<Reason>(["SUPERSEDED", "NO_HANDLES"]);

/** The pill of the connection, the banner while something is wrong, and lines that come and go. */
export function messages(app: App, startOver: () => void): HTMLElement {
  const pill = statusPill(app);
  const title = el("strong");
  const text = el("span");
  const show = el("button", { type: "button", className: "plain", textContent: "Show where" });
  const again = el("button", { type: "button", className: "plain", textContent: "Try again", hidden: true });
  const banner = el(
    "div",
    { className: "banner", role: "alert", hidden: true },
    el("span", { className: "spinner" }),
    el("div", {}, title, text),
    show,
    again,
  );
  const hint = el("div", { className: "hint" });
  const notice = el("div", { className: "notice", role: "status", hidden: true });
  const restored = restoredNote(app, startOver);
  const aside = asideNote(app);
  let element = "";
  let late: ReturnType<typeof setTimeout> | undefined;
  show.addEventListener("click", () => pointOutNamed(app, element));
  again.addEventListener("click", () => app.tryAgain());

  const showStatus = (status: Status) => {
    pill.show(status);
    const problem = app.facts.now.problem;
    const isProblem = problem !== undefined && !quiet.has(problem.reason) && status.kind === "live";
    const isWrong = isPassing(status) || status.kind === "refused";
    element = isProblem ? problem.element : status.element;
    setText(title, isProblem ? "The server cannot take this change" : status.title);
    setText(text, isProblem ? sentence(problem.message) : status.text);
    banner.dataset["kind"] = isProblem ? "refused" : status.kind;
    const { vertices, edges, faces } = elementsIn(element, app.document.handles);
    show.hidden = vertices.length + edges.length + faces.length === 0;
    again.hidden = !status.canTryAgain;
    banner.hidden = !isWrong && !isProblem;
  };
  const stopWaiting = () => {
    clearTimeout(late);
    late = undefined;
  };
  const sayAway = () => {
    late = undefined;
    showStatus(app.facts.now.status);
    showHint();
  };
  const showHint = () => {
    setText(hint, hintOf(app));
    const isSaid = !banner.hidden || !notice.hidden || app.facts.now.restoredFrom !== undefined;
    hint.hidden = app.isWatching || hint.textContent === "" || isSaid;
  };
  app.facts.watch(
    ({ status, problem }) => [status, problem],
    ([status], [before]) => {
      // A short interruption needs no message. Its length does not depend on what else changes meanwhile.
      if (status.kind !== "away" || status === notAnswering) stopWaiting();
      else if (before.kind === "live") late ??= setTimeout(sayAway, awayMs);
      if (late === undefined) showStatus(status);
      showHint();
    },
  );
  app.facts.watch(({ document, canUndo, restoredFrom }) => [document.handles.length, canUndo, restoredFrom], showHint);
  app.view.watchAll(showHint);
  startNotices(app, notice, showHint);
  app.stages.addEventListener("pointerdown", () => aside.classList.add("small"), { capture: true });
  return el("div", { className: "messages" }, pill.element, banner, hint, restored, aside, betterButton(app), notice);
}

/** There while the server knows a shape of lower energy; takes those of all panes. */
function betterButton(app: App): HTMLElement {
  const take = el("button", { type: "button", className: "plain better", hidden: true });
  take.addEventListener("click", () => app.takeBetter());
  app.facts.watch(
    ({ better }) => [better],
    ([better]) => {
      take.hidden = better.length === 0;
      if (better.length > 0) setText(take, betterText(better));
    },
  );
  return take;
}

/** For the shares of energy that shapes save, of which there is at least one. */
export function betterText(shares: readonly number[]): string {
  const most = percent(Math.max(...shares));
  return shares.length === 1 ? `Take a shape with ${most} less energy` : `Take shapes with up to ${most} less energy`;
}

/** Says that the work was restored, until it is changed or the note is dismissed. */
function restoredNote(app: App, startOver: () => void): HTMLElement {
  const text = el("span");
  const discard = el("button", { type: "button", className: "plain", textContent: "Discard it" });
  const keep = el("button", { type: "button", className: "plain", textContent: "Go on" });
  discard.addEventListener("click", startOver);
  keep.addEventListener("click", () => app.facts.set({ restoredFrom: undefined }));
  const note = el("div", { className: "restored", role: "status", hidden: true }, text, keep, discard);
  app.facts.watch(
    ({ restoredFrom, mesh }) => [restoredFrom, mesh],
    ([restoredFrom, mesh]) => {
      note.hidden = restoredFrom === undefined;
      if (restoredFrom !== undefined) setText(text, `“${mesh.name}” is here again as you left it ${ago(restoredFrom)}.`);
    },
  );
  return note;
}

/** Lists works that were set aside; each can be restored. */
function asideNote(app: App): HTMLElement {
  const text = el("span");
  const which = el("select", { aria: { label: "Work that was set aside" } });
  const back = el("button", { type: "button", className: "plain", textContent: "Bring it back" });
  const dismiss = el("button", { type: "button", className: "plain", textContent: "Dismiss" });
  back.addEventListener("click", () => void app.bringBack(Number(which.value)));
  dismiss.addEventListener("click", () => app.dismissAside(Number(which.value)));
  const note = el("div", { className: "aside", role: "status", hidden: true }, text, which, back, dismiss);
  app.facts.watch(
    ({ setAside }) => [setAside],
    ([setAside]) => {
      const [newest] = setAside;
      note.hidden = newest === undefined;
      note.classList.remove("small");
      which.hidden = setAside.length < 2;
      which.replaceChildren(...setAside.map(({ id, name }) => el("option", { value: String(id), textContent: name })));
      if (!newest) return;
      const one = `“${newest.name}” was set aside with your work on it.`;
      back.title = setAside.length > 1 ? "" : one;
      setText(text, setAside.length > 1 ? `${setAside.length} were set aside with your work:` : one);
    },
  );
  return note;
}

/** "just now", "5 minutes ago". */
function ago(time: number): string {
  const minutes = Math.round((Date.now() - time) / 60_000);
  if (minutes < 2) return "just now";
  const words = new Intl.RelativeTimeFormat("en");
  if (minutes < 120) return words.format(-minutes, "minute");
  return minutes < 48 * 60 ? words.format(-Math.round(minutes / 60), "hour") : words.format(-Math.round(minutes / 1440), "day");
}

/** A hint at the next step, until the user knows the page. */
function hintOf(app: App): string {
  const { document, status } = app.facts.now;
  const { tool } = app.view.now;
  if (status.kind !== "live") return "";
  if (tool === "brush") return "Paint over the surface: what you paint becomes a handle";
  if (tool === "lasso" || tool === "box") {
    const turning = touches() ? "two fingers turn the view" : "hold the space bar to turn the view";
    return `Draw around a part of the surface; ${turning}`;
  }
  if (tool === "paint") return "Paint over the surface: low p gathers distortion, stiffness keeps it away";
  if (document.handles.length === 0) return `${capital(pressing())} the surface to place a first handle`;
  if (document.handles.length === 1) return "Place a second handle: one stays, the other is dragged";
  return app.history.canUndo ? "" : "Drag the coloured handle and watch the surface follow";
}
