/** Values that views are made from. Each watcher is told of the changes that it asks for, once each, and of no others. */
export class State<Values extends object> {
  readonly #watchers = new Set<() => void>();
  #values: Values;

  constructor(values: Values) {
    this.#values = values;
  }

  get now(): Values {
    return this.#values;
  }

  set(change: Partial<Values>): void {
    const before = this.#values;
    const keys = Object.keys(change) as (keyof Values)[];
    if (keys.every((key) => change[key] === before[key])) return;
    this.#values = { ...before, ...change };
    for (const watcher of this.#watchers) watcher();
  }

  /**
   * Calls `watcher` at once, and then when a value of what `pick` returns has become another one. `before`: what was picked the
   * time before; the first time it is what is picked now. Ends when `signal` aborts: what the watcher knows of is held until then.
   */
  watch<const Picked extends readonly unknown[]>(
    pick: (values: Values) => Picked,
    watcher: (picked: Picked, before: Picked) => void,
    signal?: AbortSignal,
  ): void {
    let last = pick(this.#values);
    const look = () => {
      const before = last;
      const picked = pick(this.#values); // a watcher before this one may have changed them again
      if (picked.every((value, k) => Object.is(value, before[k]))) return;
      last = picked;
      watcher(picked, before);
    };
    this.#watchers.add(look);
    signal?.addEventListener("abort", () => this.#watchers.delete(look));
    watcher(last, last);
  }

  /** Like watch(), for every change. */
  watchAll(watcher: (values: Values, before: Values) => void): void {
    this.watch(
      (values) => [values],
      ([values], [before]) => watcher(values, before),
    );
  }
}
