const restMs = 300;
/** If a picture takes longer than this, it is drawn more coarsely while it moves. */
const slowMs = 55;
const coarse = 0.6;

/** How finely to draw: coarsely while the picture moves and drawing is slow, finely at rest. */
export class Pace {
  quality = 1;
  #last = -Infinity;
  #isFine = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #interval = 16;

  /** `rest`: called when nothing has moved for some time. */
  constructor(readonly rest: () => void) {}

  /** A picture was drawn because something had changed. */
  drew(now: number): void {
    const interval = now - this.#last;
    if (interval < restMs) {
      this.#interval += 0.15 * (interval - this.#interval);
      if (this.#interval > slowMs) this.quality = coarse; // until rest, because changing the size costs a picture
    }
    this.#last = now;
    this.#isFine = false;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(this.rest, restMs + 20);
  }

  /** Returns true once, when it is time for a fine picture. */
  isAtRest(now: number): boolean {
    if (this.#isFine || now - this.#last < restMs) return false;
    this.#isFine = true;
    this.quality = 1;
    return true;
  }
}
