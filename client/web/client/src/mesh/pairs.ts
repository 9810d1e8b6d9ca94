/** A number for each ordered pair of vertices, like a Map but much faster. */
export class Pairs {
  readonly #first: Int32Array;
  readonly #second: Int32Array;
  readonly #values: Int32Array;
  readonly #mask: number;
  #size = 0;

  /** For at most this many pairs. */
  constructor(most: number) {
    const room = 2 ** Math.ceil(Math.log2(1.4 * most + 8));
    this.#first = new Int32Array(room);
    this.#second = new Int32Array(room);
    this.#values = new Int32Array(room).fill(-1);
    this.#mask = room - 1;
  }

  get size(): number {
    return this.#size;
  }

  /** -1 if there is none. */
  get(a: number, b: number): number {
    return this.#values[this.#slot(a, b)]!;
  }

  /** Replaces the pair's value. `value`: from 0 on. Returns true if the pair had none. */
  set(a: number, b: number, value: number): boolean {
    const slot = this.#slot(a, b);
    const isNew = this.#values[slot]! < 0;
    if (isNew) {
      ++this.#size;
      this.#first[slot] = a;
      this.#second[slot] = b;
    }
    this.#values[slot] = value;
    return isNew;
  }

  /** The slot of the pair, or the free one where it would be. */
  #slot(a: number, b: number): number {
    const mixed = Math.imul(a, 0x9e3779b1) ^ Math.imul(b, 0x85ebca6b);
    let slot = (mixed ^ (mixed >>> 15)) & this.#mask;
    while (this.#values[slot]! >= 0 && (this.#first[slot] !== a || this.#second[slot] !== b))
      slot = (slot + 1) & this.#mask;
    return slot;
  }
}
