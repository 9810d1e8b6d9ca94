/** All of a history, to go back to it. */
export interface Steps<Value> {
  past: Value[];
  present: Value;
  future: Value[];
}

/** Undo and redo of an immutable value. A gesture is many values and one step. */
export class History<Value> {
  #past: Value[] = [];
  #future: Value[] = [];
  #present: Value;
  #before: Value | undefined;

  /** `isSame`: of values of which the second is no step beyond the first. */
  constructor(
    present: Value,
    readonly isSame: (a: Value, b: Value) => boolean = Object.is,
    readonly most = 200,
  ) {
    this.#present = present;
  }

  get present(): Value {
    return this.#present;
  }

  get canUndo(): boolean {
    return this.#past.length > 0 || (this.#before !== undefined && this.#before !== this.#present);
  }

  get canRedo(): boolean {
    return this.#future.length > 0;
  }

  /** A step of its own. */
  push(value: Value): void {
    this.end();
    this.during(value);
    this.end();
  }

  /** A value on the way; end() makes a step of all since the last one. */
  during(value: Value): void {
    this.#before ??= this.#present;
    this.#present = value;
  }

  end(): void {
    const before = this.#before;
    this.#before = undefined;
    if (before === undefined) return;
    if (this.isSame(before, this.#present)) {
      this.#present = before;
      return;
    }
    this.#past.push(before);
    if (this.#past.length > this.most) this.#past.shift();
    this.#future = [];
  }

  /** As if the gesture had not been. False where there is none. */
  cancel(): boolean {
    if (this.#before === undefined) return false;
    this.#present = this.#before;
    this.#before = undefined;
    return true;
  }

  undo(): boolean {
    this.end();
    const value = this.#past.pop();
    if (value === undefined) return false;
    this.#future.push(this.#present);
    this.#present = value;
    return true;
  }

  redo(): boolean {
    this.end();
    const value = this.#future.pop();
    if (value === undefined) return false;
    this.#past.push(this.#present);
    this.#present = value;
    return true;
  }

  /** After which another history may take the place of this one. */
  get steps(): Steps<Value> {
    this.end();
    return { past: [...this.#past], present: this.#present, future: [...this.#future] };
  }

  restore({ past, present, future }: Steps<Value>): void {
    this.#past = [...past];
    this.#future = [...future];
    this.#before = undefined;
    this.#present = present;
  }

  /** Begins anew. */
  reset(value: Value): void {
    this.restore({ past: [], present: value, future: [] });
  }
}
