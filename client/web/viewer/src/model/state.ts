/** Values that views are made from. Watchers are told of every change, once. */
export class State<Values extends object> {
  readonly #watchers = new Set<(values: Values, before: Values) => void>();
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
    for (const watcher of this.#watchers) watcher(this.#values, before);
  }

  watch(watcher: (values: Values, before: Values) => void): void {
    this.#watchers.add(watcher);
    watcher(this.#values, this.#values);
  }
}
