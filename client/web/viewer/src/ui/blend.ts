import type { App } from "../app/app.js";
import { Blend } from "../app/blend.js";
import { blendPs } from "../model/blend.js";
import { mostP } from "../model/exponent.js";
import { short } from "../model/words.js";
import { slider } from "./controls.js";
import { pAt, shareOf } from "./dock.js";
import { el, setText, toggle } from "./dom.js";

/** One slider from paper to rubber. */
export function blendPanel(app: App): HTMLElement {
  const blend = new Blend(app);
  const status = el("p", { className: "quiet", role: "status" });
  const said = el("p", { className: "quiet" });
  const on = toggle(
    "Prepare blending",
    false,
    (isOn) => blend.switch(isOn),
    "Solves for several p while nothing else is done, in a session of its own",
  );
  let p = app.document.p;
  const { element, show } = slider(
    "Blend p",
    0,
    1,
    0.002,
    (share) => {
      p = pAt(share);
      show(share, short(p));
      const found = blend.show(p);
      if (!found) return;
      const { low, high } = found;
      const between = `Interpolated between p = ${short(low)} and ${short(high)}; solved when you let go.`;
      setText(said, low === high ? `Solved at p = ${short(low)}.` : between);
    },
    () => {
      blend.release(p);
      setText(said, "");
    },
  );
  element.title = "Passes through the shapes of all p at once, in the first picture";
  const input = element.querySelector("input")!;
  app.facts.watch(
    ({ document }) => [document.p],
    ([now]) => {
      p = now;
      show(shareOf(now), short(now));
    },
  );
  const showStatus = () => {
    const { isOn, ready, fault } = blend.facts.now;
    on.input.checked = isOn;
    input.disabled = ready < 2;
    element.classList.toggle("disabled", ready < 2);
    const { isAutomatic, handles } = app.document;
    const waiting = isAutomatic ? "p comes from the shape: nothing is blended." : "There is no handle yet.";
    const progress = ready < blendPs.length ? `${ready} of ${blendPs.length} shapes are ready.` : "All shapes are ready.";
    const text = isAutomatic || handles.length === 0 ? waiting : fault ? `Not all is ready. ${fault}` : progress;
    setText(status, isOn ? text : `One slider from paper (p = 1) to rubber (p = ${mostP}), without waiting for the solver.`);
  };
  blend.facts.watchAll(showStatus);
  app.facts.watch(({ document }) => [document.isAutomatic, document.handles.length], showStatus);
  return el("div", { className: "blend" }, status, on.element, element, said);
}
