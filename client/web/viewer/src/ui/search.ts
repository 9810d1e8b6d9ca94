import type { MinimaSearch } from "lpdeform-client";
import type { App } from "../app/app.js";
import { percent } from "../model/words.js";
import { el, toggle } from "./dom.js";

/** Starts for each unit of effort. */
const startsOfEffort = 12;
const efforts = [0, 1, 2, 4, 8, 16, 64];
const usualShare = 0.02;
const shares = [0.001, 0.005, 0.01, usualShare, 0.05, 0.1, 0.2];

/** How far the server looks for lower minima while nothing changes, and what it does with one. */
export function searchPanel(app: App): HTMLElement {
  const about = el(
    "p",
    { className: "quiet" },
    "Below p = 2 a pose has many minima. While nothing changes, the server looks for lower ones than the one that is shown. The starts chosen here follow one another. A mesh of up to 15,000 vertices may get more after them, with pauses.",
  );
  const change = (part: MinimaSearch) => app.view.set({ search: { ...app.view.now.search, ...part } });
  const starts = select("How far to look for lower minima", ["", "as the server decides"]);
  const offerStarts = (effort: number) =>
    offer(starts, effort, effort === 0 ? "not at all" : `${(startsOfEffort * effort).toLocaleString("en")} starts`);
  for (const effort of efforts) offerStarts(effort);
  starts.title = "Each start takes up to two or three times as long as the first minimum";
  starts.addEventListener("change", () => {
    const { effort: _, ...others } = app.view.now.search;
    app.view.set({ search: starts.value === "" ? others : { ...others, effort: Number(starts.value) } });
  });
  const least = select("Least saving of energy");
  const offerShare = (share: number) => offer(least, share, `at least ${percent(share)}`);
  for (const share of shares) offerShare(share);
  least.addEventListener("change", () => change({ leastShare: Number(least.value) }));
  const show = toggle("Show at once", false, (isOn) => change({ show: isOn }), "Otherwise a button offers a better shape");
  app.view.watch(
    ({ search }) => [search],
    ([{ effort, leastShare, show: isShown = false }]) => {
      const share = leastShare || usualShare;
      if (effort !== undefined) offerStarts(effort); // those of a file may be others
      offerShare(share);
      starts.value = effort === undefined ? "" : String(effort);
      least.value = String(share);
      show.input.checked = isShown;
    },
  );
  return el(
    "div",
    {},
    about,
    el("label", { className: "pair" }, el("span", {}, "Search"), starts),
    el("label", { className: "pair" }, el("span", {}, "Saving"), least),
    show.element,
  );
}

function select(label: string, ...options: (readonly [string, string])[]): HTMLSelectElement {
  const made = options.map(([value, textContent]) => el("option", { value, textContent }));
  return el("select", { aria: { label } }, ...made);
}

/** Adds a choice in the order of the numbers, if it is not there. */
function offer(among: HTMLSelectElement, value: number, textContent: string): void {
  const options = [...among.options];
  if (options.some((option) => option.value === String(value))) return;
  const next = options.find((option) => option.value !== "" && Number(option.value) > value);
  among.insertBefore(el("option", { value: String(value), textContent }), next ?? null);
}
