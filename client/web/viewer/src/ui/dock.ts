import type { App } from "../app/app.js";
import type { Facts } from "../app/facts.js";
import { placeOf, watchPlaces } from "../app/sides.js";
import type { Document } from "../model/document.js";
import { leastP, mostP, steppedP } from "../model/exponent.js";
import { capital, short } from "../model/words.js";
import { el, measured, setText, toggle } from "./dom.js";
import { numberField } from "./number_field.js";

/** The values in the paper's figures. */
const stops = [1, 1.5, 2, 6] as const;
/** Low values take most of the slider, because they differ most: share = log(p) / log(12). */
export function shareOf(p: number): number {
  return Math.log(p / leastP) / Math.log(mostP / leastP);
}

export function pAt(share: number): number {
  const p = leastP * (mostP / leastP) ** share;
  const near = stops.find((stop) => Math.abs(shareOf(stop) - share) < 0.012);
  return near ?? Math.round(p * 20) / 20;
}

type Field = "p" | "secondP";

/** Of the first picture. */
function shownP({ document, previewP }: Facts): number {
  return previewP ?? document.p;
}

/** The slider of p at the lower edge (two of them in the split view), and automatic p. */
export function dock(app: App): HTMLElement {
  const first = pSlider(app, "p");
  const second = pSlider(app, "secondP");
  const automatic = toggle(
    "Automatic",
    false,
    (isAutomatic) => app.change({ ...app.document, isAutomatic }),
    "p and stiffness from the shape: joints soft, the parts between them rigid",
  );
  const hint = el("p", { className: "p-words" });
  const explain = () => setText(hint, wordsOf({ ...app.document, p: shownP(app.facts.now) }, app.view.now.isSplit));
  app.facts.watch(
    (facts) => {
      const { secondP, isAutomatic, paintedP, stiffness } = facts.document;
      return [isAutomatic, shownP(facts), secondP, paintedP, stiffness];
    },
    ([isAutomatic]) => {
      automatic.input.checked = isAutomatic;
      explain();
    },
  );
  app.view.watchAll(({ isSplit }) => {
    second.hidden = !isSplit;
    explain();
  });
  watchPlaces(explain);
  const under = el("div", { className: "under" }, hint, automatic.element);
  return measured(el("section", { className: "dock", aria: { label: "p" } }, first, second, under), "--dock-height");
}

function pSlider(app: App, field: Field): HTMLElement {
  const input = el("input", {
    type: "range",
    min: "0",
    max: "1",
    step: "0.002",
    aria: { label: "p" },
  });
  const set = (p: number) => ({ ...app.document, [field]: p, isAutomatic: false });
  input.addEventListener("input", (event) => app.during(set(pAt(input.valueAsNumber)), event.timeStamp));
  input.addEventListener("change", () => app.endGesture());
  input.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 0.1, ArrowUp: 0.1, ArrowLeft: -0.1, ArrowDown: -0.1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    const p = steppedP(app.document[field], step);
    if (p !== app.document[field] || app.document.isAutomatic) app.byKey(set(p), event);
  });
  const number = numberField({
    label: "Value of p",
    title: `p as a number from ${leastP} to ${mostP}: Enter takes it, arrow keys change it`,
    range: [leastP, mostP],
    step: () => 0.01,
    entered: (p) => app.change(set(p)),
    stepped: (p, event) => app.byKey(set(steppedP(p, 0)), event),
    refused: (why) => app.notify(why, true),
  });
  const ticks = stops.map((stop) => {
    const tick = el("button", {
      type: "button",
      className: "stop",
      textContent: String(stop),
      title: `p = ${stop}`,
      style: `--share: ${shareOf(stop) * 100}%`,
    });
    tick.addEventListener("click", () => app.change(set(stop)));
    return tick;
  });
  app.facts.watch(
    (facts) => [field === "p" ? shownP(facts) : facts.document[field], facts.document.isAutomatic],
    ([p, isAutomatic]) => {
      input.valueAsNumber = shareOf(p);
      input.style.setProperty("--share", `${shareOf(p) * 100}%`);
      input.setAttribute("aria-valuetext", short(p));
      number.show(p, isAutomatic ? "auto" : undefined);
      ticks.forEach((tick, k) => tick.setAttribute("aria-pressed", String(!isAutomatic && stops[k] === p)));
    },
  );
  const track = el("div", { className: "p-track" }, input, el("div", { className: "stops" }, ...ticks));
  const side = field === "p" ? "first" : "second";
  const place = el("small");
  const name = () => {
    const { isSplit } = app.view.now;
    setText(place, isSplit ? placeOf(side) : "");
    place.hidden = !isSplit;
    const picture = isSplit ? ` of the ${placeOf(side)} picture` : "";
    input.setAttribute("aria-label", `p${picture}`);
    number.element.setAttribute("aria-label", `Value of p${picture}`);
  };
  app.view.watchAll(name);
  watchPlaces(name);
  return el("div", { className: "p-row" }, el("span", { className: "p-name" }, "p", place), track, number.element);
}

function wordsOf({ p, secondP, isAutomatic, paintedP, stiffness }: Document, isSplit: boolean): string {
  if (isAutomatic) return "From the shape: joints soft, parts rigid";
  const words = isSplit
    ? `${capital(placeOf("first"))}: ${effectOf(p)}\n${capital(placeOf("second"))}: ${effectOf(secondP)}`
    : effectOf(p);
  return paintedP || stiffness ? `${words} · painted parts as painted` : words;
}

function effectOf(p: number): string {
  if (p < 1.25) return "Gathers in creases; the rest keeps its shape";
  if (p < 1.8) return "Between crease and even";
  if (p < 2.5) return "As rigid as possible: spreads evenly";
  return "No peaks: every place gives a little";
}
