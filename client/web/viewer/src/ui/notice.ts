import type { App } from "../app/app.js";
import type { Facts } from "../app/facts.js";
import { el, setText } from "./dom.js";

/** How long a line stays; twice as long if something is wrong. */
const noticeMs = 6000;
/** Longer ones do not fit into the place of the hint beside the options of a tool. */
const mostBeside = 120;

/** Shows in `line` what is said for some seconds. `changed`: called when the line has come or gone. */
export function startNotices(app: App, line: HTMLElement, changed: () => void): void {
  const words = el("span");
  line.append(words);
  const tell = makeWay(app, line);
  let timer: ReturnType<typeof setTimeout> | undefined;
  const show = (isShown: boolean) => {
    line.hidden = !isShown;
    changed();
  };
  app.facts.watch(
    ({ notice }) => [notice],
    ([now]) => {
      clearTimeout(timer);
      if (now) {
        setText(words, now.text);
        line.classList.toggle("long", now.text.length > mostBeside);
        tell();
      }
      line.classList.toggle("bad", now?.isBad === true);
      show(now !== undefined);
      if (now && !now.stays) timer = setTimeout(() => show(false), now.isBad ? 2 * noticeMs : noticeMs);
    },
  );
}

/**
 * Lets no line lie over what is dragged in a picture: a press ends it, or hides it for so long if it has still to be read. Where room is
 * little, a line takes its height from the pictures (small.css); they get it back only after the press, because they must not move
 * during a drag. Returns what tells the style sheet that a line has come.
 */
function makeWay(app: App, line: HTMLElement): () => void {
  let height = 0;
  let isHeld = false;
  let ended: Facts["notice"];
  const tell = () => {
    if (isHeld) return;
    const { style } = document.documentElement;
    style.setProperty("--notice-height", `${height}px`);
    style.setProperty("--strip-notice-height", line.classList.contains("long") ? "0px" : `${height}px`);
  };
  new ResizeObserver(([entry]) => {
    height = entry!.borderBoxSize[0]?.blockSize ?? 0;
    tell();
  }).observe(line);
  const press = () => {
    const { notice: now } = app.facts.now;
    if (now && !now.isBad && !now.stays) ended = now;
    isHeld = true;
    line.classList.add("makes-way");
  };
  const release = () => {
    if (!isHeld) return;
    isHeld = false;
    if (ended && app.facts.now.notice === ended) app.facts.set({ notice: undefined });
    ended = undefined;
    line.classList.remove("makes-way");
    tell();
  };
  // Before the picture has the event: its press may make a line of its own.
  app.stages.addEventListener("pointerdown", press, { capture: true });
  for (const end of ["pointerup", "pointercancel"]) window.addEventListener(end, release, { capture: true });
  return tell;
}
