import type { LpdeformError } from "lpdeform-client";
import type { App } from "../app/app.js";
import { sessionOf, watchedIn, watchedStatus } from "../link/watched.js";
import { say } from "../link/status.js";
import { button } from "./controls.js";
import { el, setText } from "./dom.js";
import { icon } from "./icons.js";
import { legend } from "./legend.js";
import { lookPanel } from "./look.js";
import { messages } from "./messages.js";
import { title } from "./topbar.js";

/** What the page's address names, to be watched. Null: it is that of a page to work in. */
export function watchedHere(): string | null {
  return watchedIn(location.hash);
}

/** The page of somebody who watches the session that a link names. It changes nothing. */
export function watchingPage(app: App, watched: string): Node[] {
  document.body.classList.add("watching");
  void start(app, watched);
  return [
    bar(app),
    app.stages,
    legend(app),
    messages(app, () => undefined),
    el("aside", { className: "panel", aria: { label: "Side panel" } }, el("h2", {}, "Look"), lookPanel(app)),
  ];
}

async function start(app: App, watched: string): Promise<void> {
  const session = sessionOf(watched);
  if (!session) {
    const text = "It has been cut off or changed. Ask for a new one.";
    return app.facts.set({ status: say("refused", "This link is not whole", text) });
  }
  app.facts.set({ status: say("opening", "Preparing…") });
  try {
    await app.watch(session);
    fitToFirstFrame(app);
  } catch (thrown) {
    app.facts.set({ status: watchedStatus(thrown as LpdeformError) });
  }
}

/** The mesh at rest may be elsewhere. */
function fitToFirstFrame(app: App): void {
  const fit = () => {
    if (!app.panes[0]!.frame) return;
    app.afterDrawing.delete(fit);
    app.fit();
  };
  app.afterDrawing.add(fit);
}

function bar(app: App): HTMLElement {
  const theme = button("moon", "Dark or light", () => app.view.set({ isDark: !app.view.now.isDark }));
  const panel = button("panel", "Side panel", () => app.view.set({ isPanelOpen: !app.view.now.isPanelOpen }));
  app.view.watchAll(({ isDark, isPanelOpen }) => {
    theme.replaceChildren(icon(isDark ? "sun" : "moon"));
    panel.setAttribute("aria-pressed", String(isPanelOpen));
    document.body.classList.toggle("panel-closed", !isPanelOpen);
  });
  const state = el("strong");
  app.facts.watch(
    ({ status }) => [status],
    ([{ kind }]) => setText(state, kind === "live" ? "Watching live" : "Watching"),
  );
  return el(
    "header",
    { className: "topbar" },
    title(),
    state,
    el("span", { className: "space" }),
    button("fit", "Show all of it", () => app.fit()),
    theme,
    panel,
  );
}
