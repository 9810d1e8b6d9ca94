import type { App } from "../app/app.js";
import { Blend } from "../app/blend.js";
import { type Blended, blendPs } from "../model/blend.js";
import { mostP } from "../model/exponent.js";
import { short } from "../model/words.js";
import { slider } from "./controls.js";
import { pAt, shareOf } from "./dock.js";
import { el, setText } from "./dom.js";

/** Less than this is not worth a word. */
const leastSeconds = 5;

/** One slider from paper to rubber. */
export function blendPanel(app: App): HTMLElement {
  const blend = new Blend(app);
  const status = el("p", { className: "quiet readiness" });
  const said = el("p", { className: "quiet", role: "status" });
  const say = (words: string) => {
    setText(said, words);
    status.hidden = words !== "";
  };
  const { element, show } = slider(
    "Blend p",
    0,
    1,
    0.002,
    (share) => {
      const p = pAt(share);
      const found = blend.show(p);
      if (blend.facts.now.held === undefined) return showOwn();
      show(share, short(p));
      say(wordsOf(p, found));
    },
    () => blend.release(),
    () => blend.begin(),
  );
  const showOwn = () => {
    const { p } = app.document;
    show(shareOf(p), short(p));
    say("");
  };
  element.title = "Passes through the shapes of all p at once, in the first picture";
  const input = element.querySelector("input")!;
  app.facts.watch(
    ({ document }) => [document.p],
    () => showOwn(),
  );
  blend.facts.watch(
    ({ held }) => [held],
    ([held]) => held === undefined && showOwn(),
  );
  const showStatus = () => {
    const { isAutomatic, handles } = app.document;
    input.disabled = isAutomatic || handles.length === 0;
    element.classList.toggle("disabled", input.disabled);
    setText(status, statusOf(app, blend));
  };
  blend.facts.watchAll(showStatus);
  app.facts.watch(
    ({ mesh, document, status }) => [mesh, document.isAutomatic, document.handles.length, status.kind],
    showStatus,
  );
  const ends = el("p", { className: "ends quiet" }, el("span", {}, "paper, p = 1"), el("span", {}, `rubber, p = ${mostP}`));
  return el("div", { className: "blend" }, element, ends, el("div", { className: "told" }, status, said));
}

function statusOf(app: App, blend: Blend): string {
  const { isAutomatic, handles } = app.document;
  const { waitsLong, ready, secondsLeft, fault } = blend.facts.now;
  if (isAutomatic) return "p comes from the shape: nothing is blended.";
  if (handles.length === 0) return "There is no handle yet.";
  if (fault) return `Not all is ready. ${fault}`;
  const all = blendPs.length;
  if (waitsLong) {
    const count = (app.mesh.positions.length / 3).toLocaleString("en");
    return `For ${count} vertices, shapes are prepared when nothing has changed for 20 seconds, or once you move the slider.`;
  }
  if (ready === all) return "All shapes are ready.";
  if (app.facts.now.status.kind !== "live") return `${ready} of ${all} shapes are ready. The others wait for the server.`;
  const isLong = secondsLeft !== undefined && secondsLeft >= leastSeconds;
  return `${ready} of ${all} shapes are ready${isLong ? `, the others in about ${Math.ceil(secondsLeft)} s` : ""}.`;
}

/** For what is shown while the slider is at p. */
function wordsOf(p: number, found: Blended | undefined): string {
  if (!found) return "No shape is ready yet; solved when you let go.";
  const { low, high } = found;
  if (low < high) return `Interpolated between p = ${short(low)} and ${short(high)}; solved when you let go.`;
  return low === p
    ? `Solved at p = ${short(p)}.`
    : `Shown at p = ${short(low)}, the nearest that is ready; solved when you let go.`;
}
