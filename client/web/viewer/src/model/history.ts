/** The whole of a history, to return to it. */
export interface Steps<Value> {
  past: Value[];
  present: Value;
  future: Value[];
}

/** Undo and redo of an immutable value. A gesture is many values and a single step. */
export class History<Value> {
  #past: Value[] = [];
  #future: Value[] = [];
  #present: Value;
  #before: Value | undefined;

  /** `isSame`: whether the second of two values is not a new step. */
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

  /** Without a gesture that has not ended. */
  get settled(): Value {
    return this.#before ?? this.#present;
  }

  get canUndo(): boolean {
    return this.#past.length > 0 || (this.#before !== undefined && this.#before !== this.#present);
  }

  get canRedo(): boolean {
    return this.#future.length > 0;
  }

  /** Makes a step of its own. */
  push(value: Value): void {
    this.end();
    this.during(value);
    this.end();
  }

  /** An intermediate value; end() makes one step of all since the last step. */
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

  /** Reverts the gesture. False if there is none. */
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

  /** Another history may then replace this one. */
  get steps(): Steps<Value> {
    this.end();
    return { past: [...this.#past], present: this.#present, future: [...this.#future] };
  }

  /** The steps as they would be if the gesture under way, if there is one, ended now. It goes on. */
  get stepsSoFar(): Steps<Value> {
    const before = this.#before;
    const isStep = before !== undefined && !this.isSame(before, this.#present);
    return {
      past: isStep ? [...this.#past, before] : [...this.#past],
      present: this.#present,
      future: isStep ? [] : [...this.#future],
    };
  }

  restore({ past, present, future }: Steps<Value>): void {
    this.#past = [...past];
    this.#future = [...future];
    this.#before = undefined;
    this.#present = present;
  }

  /** Starts again. */
  reset(value: Value): void {
    this.restore({ past: [], present: value, future: [] });
  }
}
