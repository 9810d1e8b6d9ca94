import { percent } from "../model/words.js";
import type { App } from "./app.js";
import type { Solving } from "./facts.js";

/** A solve that is over sooner is not worth a word. */
const leastMs = 400;
/** How long the end is shown. */
const endMs = 2500;
/** The least that is said to be left before the end. */
const leastLeft = 0.001;

/** Follows the solves of all panes in `facts.solving`. */
export function followSolving(app: App): void {
  let since: number | undefined;
  let endedAt = -Infinity;
  let input = -1;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const look = () => {
    clearTimeout(timer);
    const now = performance.now();
    const before = app.facts.now.solving;
    const left = leftOf(app);
    const newest = Math.max(...app.panes.map(({ live }) => live?.newestInput ?? 0));
    // While a handle is dragged there is a new solve for each picture, and none is waited for.
    if (newest !== input || left === undefined) since = left === undefined ? undefined : now;
    input = newest;
    since ??= left === undefined ? undefined : now;
    const isShown = left !== undefined && now - since! >= leastMs;
    if (before && before !== "ended" && left === undefined && isLive(app)) endedAt = now;
    const solving: Solving = isShown ? { left } : left === undefined && now - endedAt < endMs ? "ended" : undefined;
    if (!isSame(solving, before)) app.facts.set({ solving });
    if (left !== undefined || solving === "ended") timer = setTimeout(look, leastMs / 2);
  };
  app.afterDrawing.add(look);
  app.facts.watch(({ document, status, problem }) => [document, status, problem], look);
}

function isLive({ facts }: App): boolean {
  return facts.now.status.kind === "live" && facts.now.problem === undefined;
}

/** The most that is left in any pane; undefined if nothing is solved. */
function leftOf(app: App): number | undefined {
  if (!isLive(app) || app.document.handles.length === 0) return undefined;
  const lefts = app.panes
    .filter(({ frame, live }) => live?.isSettling || (frame && !frame.isFinal))
    .map(({ progress, live }) => (live?.isSettling ? 1 : Math.max(progress.left, leastLeft)));
  return lefts.length > 0 ? Math.max(...lefts) : undefined;
}

/** As it is shown. */
function isSame(a: Solving, b: Solving): boolean {
  if (typeof a !== "object" || typeof b !== "object") return a === b;
  return percent(a.left) === percent(b.left);
}
