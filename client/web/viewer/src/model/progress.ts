/** How much of what is kept of a solve's past is dropped at once. */
const most = 400;
/** A single estimate may be wrong: what is left goes down to no less than this share of it with each frame. */
const slowest = 0.85;

/** What is left of a solve, from the energies of its frames. */
export class Progress {
  #inputSeq = -1;
  #past: { iteration: number; energy: number }[] = [];
  #left = 1;

  /** A frame of the update `inputSeq`; a new update is a new solve. */
  add({ inputSeq, iteration, energy }: { inputSeq: number; iteration: number; energy: number }): void {
    if (inputSeq !== this.#inputSeq) this.reset();
    this.#inputSeq = inputSeq;
    const last = this.#past.at(-1);
    if (last && energy === last.energy) return; // a coarse level is at work, which frames do not show
    // A coarse level counts by itself: what comes before the last rise says nothing of what is left.
    if (last && (iteration <= last.iteration || energy > last.energy)) this.#past = [];
    this.#past.push({ iteration, energy });
    if (this.#past.length > most) this.#past = this.#past.filter((_, k) => k % 2 === 0);
    this.#left = Math.min(this.#left, Math.max(this.#estimate() ?? 1, slowest * this.#left));
  }

  reset(): void {
    this.#past = [];
    this.#left = 1;
    this.#inputSeq = -1;
  }

  /**
   * The share of the energy's whole descent that is still to come, from 1 on; it never rises within a solve. Estimated: the
   * energy is taken to go on as it went down in the last two quarters of the iterations so far.
   */
  get left(): number {
    return this.#left;
  }

  #estimate(): number | undefined {
    const [first, last] = [this.#past[0], this.#past.at(-1)];
    if (!first || !last) return undefined;
    const quarter = (last.iteration - first.iteration) / 4;
    const middle = this.#past.findLast(({ iteration }) => iteration <= last.iteration - quarter);
    const before = middle ? 2 * middle.iteration - last.iteration : -Infinity;
    if (!middle || before < first.iteration) return undefined;
    const [early, late] = [this.#energyAt(before) - middle.energy, middle.energy - last.energy];
    if (!(early > 0)) return undefined;
    const ratio = Math.min(late / early, 0.95);
    const rest = (late * ratio) / (1 - ratio);
    return rest / (rest + first.energy - last.energy);
  }

  /** Between the frames on either side. */
  #energyAt(iteration: number): number {
    const k = this.#past.findIndex((one) => one.iteration >= iteration);
    const [before, after] = [this.#past[Math.max(k - 1, 0)]!, this.#past[k]!];
    const width = after.iteration - before.iteration;
    const share = width > 0 ? (iteration - before.iteration) / width : 0;
    return before.energy + share * (after.energy - before.energy);
  }
}
