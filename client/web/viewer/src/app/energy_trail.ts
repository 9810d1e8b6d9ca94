/** Energies (their p-th roots) by iteration, all solves in one line; the oldest are dropped. */
export class EnergyTrail {
  iterations: number[] = [];
  energies: number[] = [];
  /** Where each solve began. */
  starts: number[] = [];
  #offset = 0;
  #last = -1;

  constructor(readonly most = 600) {}

  add(iteration: number, energy: number): void {
    if (iteration < this.#last) {
      this.#offset += this.#last;
      this.starts.push(this.#offset + iteration);
    }
    this.#last = iteration;
    this.iterations.push(this.#offset + iteration);
    this.energies.push(energy);
    if (this.iterations.length <= this.most) return;
    this.iterations.shift();
    this.energies.shift();
    while (this.starts[0]! < this.iterations[0]!) this.starts.shift();
  }

  reset(): void {
    this.iterations = [];
    this.energies = [];
    this.starts = [];
    this.#offset = 0;
    this.#last = -1;
  }
}
