import type { HandleChange, Settings, Update } from "./types.js";

/** An update and its number, which the server knows as input_seq. */
export interface NumberedUpdate {
  seq: number;
  update: Update;
}

const resizeHandle = "resize";

/** `newer` on top of `older`: the newest value of each handle and setting wins; a motion moves a handle that `older` adds. */
export function merged(older: Update, newer: Update): Update {
  // Without a prototype, so that a handle may have any name.
  const handles: Record<string, HandleChange> = Object.assign(Object.create(null), older.handles);
  const settings: Settings = { ...older.settings };
  let resize = older.resize;
  if (newer.handles?.[resizeHandle]) resize = undefined;
  if (newer.resize) {
    resize = newer.resize;
    delete handles[resizeHandle];
    delete settings.p;
    delete settings.stiffness;
  }
  for (const [name, change] of Object.entries(newer.handles ?? {})) {
    const before = handles[name];
    const moved = before && "set" in before && "move" in change;
    handles[name] = moved ? { set: { ...before.set, motion: change.move } } : change;
  }
  Object.assign(settings, newer.settings);
  const beginsStep = older.beginsStep || newer.beginsStep;
  return { handles, settings, ...(resize && { resize }), ...(beginsStep && { beginsStep }) };
}

/** What is there once motions and removals have been carried out. */
function settled(state: Update): Update {
  const kept = Object.entries(state.handles ?? {}).filter(([, change]) => "set" in change);
  const { beginsStep: _, ...lasting } = state;
  return { ...lasting, handles: Object.assign(Object.create(null), Object.fromEntries(kept)) };
}

/** Bounds what is remembered of handles that are there no more. Motions stay: of handles that the session was made with. */
function withoutOldRemovals(update: Update): Update {
  const entries = Object.entries(update.handles ?? {});
  const kept = entries.filter(([, change]) => !("remove" in change));
  if (entries.length - kept.length <= Ledger.mostRemovals) return update;
  return { ...update, handles: Object.assign(Object.create(null), Object.fromEntries(kept)) };
}

function isMovesOnly({ update }: NumberedUpdate): boolean {
  const changes = Object.values(update.handles ?? {});
  return (
    !update.resize &&
    !update.beginsStep &&
    Object.keys(update.settings ?? {}).length === 0 &&
    changes.every((change) => "move" in change)
  );
}

/**
 * The writer's book of updates: what the server has accepted (all that is needed to make the session anew), what is on its
 * way, and what waits (merged into one). Bounded by the size of the handles and settings themselves.
 */
export class Ledger {
  /** Updates on their way; of these, several at a time only where all merely move handles, so that order does not matter. */
  static readonly window = 2;
  /** Handles of which it is remembered that they were let go of; of more than that, none. */
  static readonly mostRemovals = 8192;

  #nextSeq = 1;
  #epoch = 0;
  #accepted: NumberedUpdate = { seq: 0, update: {} };
  /** What was accepted since the server last kept something, as it came. */
  #unkept: NumberedUpdate = { seq: 0, update: {} };
  #restore: NumberedUpdate | undefined;
  #inFlight: NumberedUpdate[] = [];
  /** Updates that were answered, and whether they were kept. */
  readonly #answered = new Map<NumberedUpdate, boolean>();
  #waiting: NumberedUpdate | undefined;

  /** `beginsBare`: a session made anew has no handles but those of this book, else also those that it is made with. */
  constructor(readonly beginsBare = true) {}

  /** Takes an update on; returns its number. */
  add(update: Update): number {
    const seq = this.#nextSeq++;
    this.#waiting = { seq, update: merged(this.#waiting?.update ?? {}, update) };
    return seq;
  }

  get canSend(): boolean {
    const next = this.#restore ?? this.#waiting;
    if (!next) return false;
    if (this.#inFlight.length === 0) return true;
    return this.#inFlight.length < Ledger.window && [...this.#inFlight, next].every(isMovesOnly);
  }

  /** What sendNext() gives is the state that a lost session had. */
  get hasRestore(): boolean {
    return this.#restore !== undefined;
  }

  get hasWaiting(): boolean {
    return this.#restore !== undefined || this.#waiting !== undefined;
  }

  get hasInFlight(): boolean {
    return this.#inFlight.length > 0;
  }

  /** What is to be sent next, now on its way. */
  sendNext(): NumberedUpdate {
    const next = this.#restore ?? this.#waiting;
    if (!next) throw new Error("nothing waits");
    if (this.#restore) this.#restore = undefined;
    else this.#waiting = undefined;
    const sent = { ...next }; // each sending is one of its own
    this.#inFlight.push(sent);
    return sent;
  }

  /**
   * Whether it waits for an answer yet. After connectionLost() it does not: what it held is sent again, perhaps with more, and an
   * answer that comes late says nothing of that.
   */
  isInFlight(sent: NumberedUpdate): boolean {
    return this.#inFlight.includes(sent);
  }

  /**
   * The server has taken what sendNext() gave. Taken on in the order of sending, however answers overtake each other.
   * `isKept`: it, and all taken before it, survive the end of the server.
   */
  accept(sent: NumberedUpdate, isKept = false): void {
    if (this.isInFlight(sent)) this.#answered.set(sent, isKept);
    else if (isKept && sent.seq >= this.#unkept.seq) this.#unkept = { seq: 0, update: {} }; // shown before it was answered
    this.#takeAnswered();
  }

  /**
   * A frame shows the update of this number. If it is of the present epoch, the update is ours, so the server has taken it,
   * though its answer may still be on its way. Earlier updates without an answer may have been refused: then nothing changes
   * until they are answered.
   */
  show(epoch: number, seq: number): void {
    const [first] = this.#inFlight;
    if (epoch === this.#epoch && first?.seq === seq) this.accept(first);
  }

  #takeAnswered(): void {
    for (let sent = this.#inFlight[0]; sent && this.#answered.has(sent); sent = this.#inFlight[0]) {
      this.#inFlight.shift();
      const isKept = this.#answered.get(sent)!;
      this.#answered.delete(sent);
      this.#takeOn(sent, isKept);
    }
  }

  #takeOn({ seq, update }: NumberedUpdate, isKept: boolean): void {
    if (!isKept) {
      const unkept = withoutOldRemovals(merged(this.#unkept.update, update));
      this.#unkept = { seq: Math.max(this.#unkept.seq, seq), update: unkept };
    } else if (seq >= this.#unkept.seq) {
      this.#unkept = { seq: 0, update: {} };
    }
    const accepted = merged(this.#accepted.update, update);
    this.#accepted = {
      seq: Math.max(this.#accepted.seq, seq),
      update: this.beginsBare ? settled(accepted) : withoutOldRemovals(accepted),
    };
  }

  /** A number for a change that the server makes by itself. */
  takeNumber(): number {
    return this.#nextSeq++;
  }

  /** The change of that number. */
  acceptChange(change: NumberedUpdate, isKept: boolean): void {
    this.#takeOn(change, isKept);
  }

  /** The server has refused what sendNext() gave. */
  refuse(sent: NumberedUpdate): void {
    this.#inFlight = this.#inFlight.filter((one) => one !== sent);
    this.#takeAnswered();
  }

  /**
   * The session goes on, and the newest update that it has is `seq`: what it took after that and did not keep is to be sent
   * first, on its own.
   */
  resumedAt(seq: number): void {
    if (seq < this.#unkept.seq) this.#restore ??= { seq: this.#accepted.seq, update: this.#unkept.update };
  }

  /**
   * The same of a session that is at `epoch`. In a newer one than before another server has it, and its newest update says
   * nothing of those before that: a call may have brought it there. So all that was not kept is sent; of what the server has
   * that changes nothing.
   */
  reopened(epoch: number, seq: number): void {
    const isAnother = epoch > this.#epoch;
    this.#epoch = Math.max(epoch, this.#epoch);
    this.resumedAt(isAnother ? 0 : seq);
  }

  /** Of a session just made, joined or taken over. */
  beginEpoch(epoch: number): void {
    this.#epoch = epoch;
  }

  /** What was on its way waits again. Sending it twice does no harm, it is the same value. */
  connectionLost(): void {
    let again: NumberedUpdate | undefined;
    for (const sent of this.#inFlight) {
      if (sent.seq === this.#accepted.seq)
        this.#restore = sent; // an unanswered restore stays on its own
      else again = { seq: sent.seq, update: merged(again?.update ?? {}, sent.update) };
    }
    this.#inFlight = [];
    this.#answered.clear();
    if (!again) return;
    this.#waiting = this.#waiting
      ? { seq: this.#waiting.seq, update: merged(again.update, this.#waiting.update) }
      : again;
  }

  /** The server has lost the session: what it had accepted is to be sent first, on its own. */
  sessionLost(): void {
    this.connectionLost();
    if (this.#accepted.seq > 0) this.#restore = this.#accepted;
  }

  /** Another writer took over: what the server has not taken is void, and so is what it took and may have lost. */
  dropUnaccepted(): void {
    this.#restore = undefined;
    this.#unkept = { seq: 0, update: {} };
    this.#inFlight = [];
    this.#answered.clear();
    this.#waiting = undefined;
  }

  /** Numbers that follow are higher than `seq`, the newest that the server knows. */
  countFrom(seq: number): void {
    if (this.#nextSeq > seq) return;
    this.#nextSeq = seq + 1;
    if (this.#waiting) this.#waiting = { ...this.#waiting, seq: this.#nextSeq++ };
  }

  /** The newest update that was not refused; 0 where there is none. */
  get newest(): number {
    return this.#waiting?.seq ?? Math.max(this.#accepted.seq, ...this.#inFlight.map((one) => one.seq));
  }
}
