import type { HandleChange, Settings, Update } from "./types.js";

/** An update and its number, the input_seq for the server. */
export interface NumberedUpdate {
  seq: number;
  update: Update;
}

const resizeHandle = "resize";

/**
 * `older` and then `newer` as one update: the newest value of each handle and setting wins; a motion moves a handle that
 * `older` adds.
 */
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

/** Both as one update, whichever came first; of equal numbers, `one` is the older. */
function joined(one: NumberedUpdate, other: NumberedUpdate): NumberedUpdate {
  const [older, newer] = other.seq < one.seq ? [other, one] : [one, other];
  return { seq: newer.seq, update: merged(older.update, newer.update) };
}

/** The state after all motions and removals have been carried out. */
function settled(state: Update): Update {
  const kept = Object.entries(state.handles ?? {}).filter(([, change]) => "set" in change);
  const { beginsStep: _, ...lasting } = state;
  return { ...lasting, handles: Object.assign(Object.create(null), Object.fromEntries(kept)) };
}

/** Limits how many removed handles are remembered. Motions stay: they may move handles that the session was created with. */
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
 * The writer's record of updates: what the server has accepted (which is enough to recreate the session), what is under way,
 * and what waits, coalesced into one update. Its size is bounded by the handles and settings themselves.
 */
export class Ledger {
  /**
   * How many updates may be under way. There are several only if all of them merely move handles, so that their order does not
   * matter.
   */
  static readonly window = 2;
  /** How many removed handles are remembered. If there are more, all of them are forgotten. */
  static readonly mostRemovals = 8192;

  #nextSeq = 1;
  #epoch = 0;
  #accepted: NumberedUpdate = { seq: 0, update: {} };
  /** Accepted since the server last stored something, as sent. */
  #unkept: NumberedUpdate = { seq: 0, update: {} };
  /** What the server may have lost, with what it has accepted since. */
  #restore: NumberedUpdate | undefined;
  #inFlight: NumberedUpdate[] = [];
  /** The restores under way, with what to send if they have to be sent again. */
  readonly #restores = new Map<NumberedUpdate, NumberedUpdate>();
  /** Updates that were answered, and whether they were stored. */
  readonly #answered = new Map<NumberedUpdate, boolean>();
  #waiting: NumberedUpdate | undefined;

  /**
   * `beginsBare`: whether a recreated session has no handles but those recorded here; otherwise it also has those of its copy.
   */
  constructor(readonly beginsBare = true) {}

  /** Accepts an update and returns its number. */
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

  /** Whether sendNext() will return the state of a lost session. */
  get hasRestore(): boolean {
    return this.#restore !== undefined;
  }

  get hasWaiting(): boolean {
    return this.#restore !== undefined || this.#waiting !== undefined;
  }

  get hasInFlight(): boolean {
    return this.#inFlight.length > 0;
  }

  /** The next update to send, which is now under way. */
  sendNext(): NumberedUpdate {
    const next = this.#restore ?? this.#waiting;
    if (!next) throw new Error("nothing waits");
    const sent = { ...next }; // each sending is an object of its own
    this.#inFlight.push(sent);
    if (this.#restore) this.#restores.set(sent, sent);
    if (this.#restore) this.#restore = undefined;
    else this.#waiting = undefined;
    return sent;
  }

  /**
   * Whether the update still waits for an answer. After connectionLost() it does not: its contents are sent again, perhaps with
   * more, and a late answer to the first sending is ignored.
   */
  isInFlight(sent: NumberedUpdate): boolean {
    return this.#inFlight.includes(sent);
  }

  /**
   * The server has accepted the update from sendNext(). Updates are recorded in the order of sending, whatever the order of the
   * answers. `isKept`: this update and all accepted before it survive a restart of the server.
   */
  accept(sent: NumberedUpdate, isKept = false): void {
    if (this.isInFlight(sent)) this.#answered.set(sent, isKept);
    else if (isKept && sent.seq >= this.#unkept.seq) this.#unkept = { seq: 0, update: {} }; // shown before it was answered
    this.#takeAnswered();
  }

  /**
   * A frame shows the update of this number. If it is of the present epoch, the update is ours, so the server has taken it,
   * though its answer may still be on its way. Earlier updates without an answer may have been refused: then nothing changes
   * until they are answered. A restore has the number of an update that was accepted before: no frame shows that it came.
   */
  show(epoch: number, seq: number): void {
    const [first] = this.#inFlight;
    if (epoch === this.#epoch && first?.seq === seq && !this.#restores.has(first)) this.accept(first);
  }

  #takeAnswered(): void {
    for (let sent = this.#inFlight[0]; sent && this.#answered.has(sent); sent = this.#inFlight[0]) {
      this.#inFlight.shift();
      const isKept = this.#answered.get(sent)!;
      this.#answered.delete(sent);
      this.#restores.delete(sent);
      this.#takeOn(sent, isKept);
    }
  }

  #takeOn({ seq, update }: NumberedUpdate, isKept: boolean): void {
    if (!isKept) {
      const { seq: newest, update: unkept } = joined(this.#unkept, { seq, update });
      this.#unkept = { seq: newest, update: withoutOldRemovals(unkept) };
    } else if (seq >= this.#unkept.seq) {
      this.#unkept = { seq: 0, update: {} };
    }
    if (this.#restore) this.#restore = joined(this.#restore, { seq, update });
    for (const [sent, again] of this.#restores) this.#restores.set(sent, joined(again, { seq, update }));
    const { seq: newest, update: accepted } = joined(this.#accepted, { seq, update });
    this.#accepted = { seq: newest, update: this.beginsBare ? settled(accepted) : withoutOldRemovals(accepted) };
  }

  /** A number for a change that the server computes itself. */
  takeNumber(): number {
    return this.#nextSeq++;
  }

  /** Records the change with that number. */
  acceptChange(change: NumberedUpdate, isKept: boolean): void {
    this.#takeOn(change, isKept);
  }

  /** The server has refused the update from sendNext(). */
  refuse(sent: NumberedUpdate): void {
    this.#inFlight = this.#inFlight.filter((one) => one !== sent);
    this.#restores.delete(sent);
    this.#takeAnswered();
  }

  /**
   * The session continues, and its newest update is `seq`. Updates that the server accepted after that and did not store are
   * sent first, by themselves.
   */
  resumedAt(seq: number): void {
    if (seq < this.#unkept.seq) this.#restore ??= { seq: this.#accepted.seq, update: this.#unkept.update };
  }

  /**
   * The same for a session that is now at `epoch`. A newer epoch means that another server has the session. Its newest update
   * may have come by a single call, so earlier updates may be missing. Therefore everything that was not stored is sent again;
   * values that the server has already do no harm.
   *
   * `asked`: newestAccepted when the stream was asked for. In the same epoch a server that has at least this has lost nothing:
   * what it accepted afterwards was answered before the word came that the stream is open.
   */
  reopened(epoch: number, seq: number, asked = Infinity): void {
    const isAnother = epoch > this.#epoch;
    this.#epoch = Math.max(epoch, this.#epoch);
    if (isAnother || seq < asked) this.resumedAt(isAnother ? 0 : seq);
  }

  /** The newest update that the server has accepted; 0 if there is none. */
  get newestAccepted(): number {
    return this.#accepted.seq;
  }

  /** The session was just created, joined or taken over. */
  beginEpoch(epoch: number): void {
    this.#epoch = epoch;
  }

  /** Updates under way wait again. Sending them twice does no harm, because they have the same values. */
  connectionLost(): void {
    let again: NumberedUpdate | undefined;
    for (const sent of this.#inFlight) {
      const restore = this.#restores.get(sent); // an unanswered restore stays separate
      if (restore) this.#restore = this.#restore ? joined(restore, this.#restore) : restore;
      else again = { seq: sent.seq, update: merged(again?.update ?? {}, sent.update) };
    }
    this.#forgetInFlight();
    if (!again) return;
    this.#waiting = this.#waiting
      ? { seq: this.#waiting.seq, update: merged(again.update, this.#waiting.update) }
      : again;
  }

  /** The server has lost the session: its accepted state is sent first, by itself. */
  sessionLost(): void {
    this.connectionLost();
    if (this.#accepted.seq > 0) this.#restore = this.#accepted;
  }

  /** Another writer took over: drops everything that the server has not accepted, and everything that it may have lost. */
  dropUnaccepted(): void {
    this.#restore = undefined;
    this.#unkept = { seq: 0, update: {} };
    this.#forgetInFlight();
    this.#waiting = undefined;
  }

  #forgetInFlight(): void {
    this.#inFlight = [];
    this.#restores.clear();
    this.#answered.clear();
  }

  /** Later numbers are higher than `seq`, the newest that the server knows. */
  countFrom(seq: number): void {
    if (this.#nextSeq > seq) return;
    this.#nextSeq = seq + 1;
    if (this.#waiting) this.#waiting = { ...this.#waiting, seq: this.#nextSeq++ };
  }

  /** The newest update that was not refused; 0 if there is none. */
  get newest(): number {
    return this.#waiting?.seq ?? Math.max(this.#accepted.seq, ...this.#inFlight.map((one) => one.seq));
  }
}
