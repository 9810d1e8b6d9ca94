import { readingOf } from "../model/reading.js";
import type { PointerAt } from "../stage/pointing.js";
import type { Pane } from "./pane.js";
import type { Workbench } from "./workbench.js";

/** How often, while the pointer moves, the surface under it is looked for. */
const everyMs = 60;
/** From the pointer, in pixels. */
const away = 16;

/** The values of the vertex under the pointer, beside it. */
export class Readout {
  readonly #element = document.createElement("div");
  #at: PointerAt | undefined;
  #vertex: number | undefined;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    readonly work: Workbench,
    readonly pane: Pane,
  ) {
    this.#element.className = "readout";
    this.#element.hidden = true;
    pane.element.append(this.#element);
    pane.over.signal.addEventListener("abort", () => clearTimeout(this.#timer));
    work.view.watch(
      ({ hasReadout }) => [hasReadout],
      ([isOn]) => isOn || this.hide(),
      pane.over.signal,
    );
  }

  /** Undefined: the pointer has left. `isByKey`: it is the cross, whose values are told to screen readers. */
  point(at: PointerAt | undefined, isByKey = false): void {
    if (!at || !this.work.view.now.hasReadout) return this.hide();
    this.#at = at;
    this.#element.setAttribute("aria-live", isByKey ? "polite" : "off");
    this.#timer ??= setTimeout(() => this.#look(), everyMs);
  }

  hide(): void {
    clearTimeout(this.#timer);
    this.#timer = this.#at = this.#vertex = undefined;
    this.#element.hidden = true;
  }

  /** The values may have changed. */
  refresh(): void {
    const { pane, work } = this;
    const at = this.#vertex;
    if (at === undefined) return;
    const { p, secondP } = work.document;
    const own = pane.side === "first" ? p : secondP;
    const text = readingOf(work.document, work.isWatching ? undefined : own, pane.frame?.distortion[at], at);
    if (this.#element.textContent !== text) this.#element.textContent = text;
  }

  #look(): void {
    this.#timer = undefined;
    this.#vertex = this.#at?.hit?.vertex;
    this.#element.hidden = this.#vertex === undefined;
    this.refresh();
    if (this.#vertex !== undefined) this.#place(this.#at!);
  }

  /** On the side of the pointer where there is room. */
  #place({ x, y }: PointerAt): void {
    const { clientWidth, clientHeight } = this.pane.element;
    const { offsetWidth, offsetHeight, style } = this.#element;
    const left = x + away + offsetWidth < clientWidth ? x + away : x - away - offsetWidth;
    const top = y + away + offsetHeight < clientHeight ? y + away : y - away - offsetHeight;
    style.translate = `${Math.max(left, 0)}px ${Math.max(top, 0)}px`;
  }
}
