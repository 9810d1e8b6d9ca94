import { FrameAssembly } from "./assembly.js";
import { FrameBox } from "./box.js";
import { fromFault, LpdeformError } from "./errors.js";
import type { GoAway } from "./gen/lpdeform/v1/service_pb.js";
import type { Lane, WireFrameOptions } from "./hub.js";
import { createSession, isSessionLost, isTakenAllTheSame, isUndecided, joinSession, type Lease } from "./lease.js";
import { Ledger, type NumberedUpdate } from "./ledger.js";
import { Packer } from "./packer.js";
import { Backoff, recoveryAfter } from "./recovery.js";
import type { Rpc } from "./rpc.js";
import { updateToWire } from "./towire.js";
import type { Connection, Frame, Mesh, OpenOptions, Update } from "./types.js";
import { newRequestId, Uploads } from "./upload.js";
import { pause } from "./waiting.js";

/** What a session that was lost can be made anew from. */
export interface Copy {
  mesh: Mesh;
  options: OpenOptions;
}

/** What did not fit so often never will: it is of another version, or something on the way breaks it. */
const mostMisfits = 5;
/** Whatever a server asks for. */
const longestRetryMs = 10_000;

export interface Watcher {
  problem(error: LpdeformError): void;
  connection(state: Connection): void;
}

/**
 * A session from within: the lease on the server's session, the ledger of updates, the box of frames, and the feed that is
 * kept alive between them.
 */
export class Link {
  readonly box = new FrameBox();
  readonly ledger = new Ledger();
  readonly stop = new AbortController();
  /** What ended the stream of frames the last time that one did. */
  interruption: LpdeformError | undefined;
  #lease: Lease;
  #lane: Lane | undefined;
  #assembly = new FrameAssembly(0);
  #goAway: GoAway | undefined;
  #connection: Connection = "idle";
  /** Who waits for frames whether they can be seen or not. */
  #waitingForFrames = 0;
  #isStreaming = false;
  #isSending = false;
  #solves = 0;
  #requestId = newRequestId();
  #making: Promise<void> | undefined;
  #downSince: number | undefined;
  /** Streams in a row that ended with a frame that does not fit. */
  #misfits = 0;
  #over: LpdeformError | undefined; // nothing is tried any more, for this reason
  readonly #backoff = new Backoff();
  readonly #quiet = new Set<() => void>();

  constructor(
    readonly rpc: Rpc,
    lease: Lease,
    readonly frameOptions: WireFrameOptions,
    readonly copy: Copy | undefined,
    readonly watcher: Watcher,
  ) {
    this.#lease = lease;
    this.ledger.countFrom(lease.inputSeq);
  }

  get lease(): Lease {
    return this.#lease;
  }

  get connection(): Connection {
    return this.#connection;
  }

  /** Nothing is tried, for now or for good. */
  get #isOver(): boolean {
    return this.isClosed || this.#over !== undefined;
  }

  get isClosed(): boolean {
    return this.stop.signal.aborted;
  }

  update(update: Update): number {
    if (this.isClosed) throw sessionClosed();
    if (this.#over) throw this.#over;
    this.requireWriter();
    const seq = this.ledger.add(update);
    this.#lane?.wake();
    this.#send();
    return seq;
  }

  requireWriter(): void {
    if (this.#lease.writerToken) return;
    throw new LpdeformError("failed_precondition", "A reader cannot change the session: takeOver() first.", {
      reason: "NOT_THE_WRITER",
    });
  }

  /** Frames come from now on. */
  startStream(): void {
    if (this.#isStreaming || this.#isOver) return;
    this.#isStreaming = true;
    this.#subscribe();
  }

  /** The newest frame not yet taken; taking it tells the server to send on. */
  take(): Frame | undefined {
    const taken = this.box.take();
    if (taken) this.#lane?.acknowledge(taken.frame.frameSeq, taken.streamId);
    return taken?.frame;
  }

  /** Frames come on a page that is hidden as well, until the result is called. */
  holdStream(): () => void {
    ++this.#waitingForFrames;
    this.startStream();
    this.#lane?.wake();
    return () => --this.#waitingForFrames;
  }

  async close(): Promise<void> {
    if (this.isClosed) return;
    this.stop.abort();
    this.#lane?.close();
    this.#setConnection("closed");
    this.box.finish("closed");
    this.#wakeQuiet();
    if (this.copy) await this.rpc.call("deleteSession", { session: this.#lease.session });
  }

  async takeOver(): Promise<void> {
    if (this.isClosed) throw sessionClosed();
    const lease = await joinSession(this.rpc, this.#lease.session, "writer", this.stop.signal);
    this.#lease = lease;
    this.ledger.countFrom(lease.inputSeq);
    this.box.beginEpoch(lease.epoch);
    this.#over = undefined;
    this.#misfits = 0;
    this.#backoff.reset();
    this.box.resume();
    this.#send();
  }

  // The stream.

  #subscribe(): void {
    this.#goAway = undefined;
    const { session } = this.#lease;
    const lane = this.rpc.hub.subscribe(session, this.frameOptions, {
      opened: (opened) => {
        this.#assembly = new FrameAssembly(opened.vertexCount);
        this.box.beginEpoch(Number(opened.epoch));
        this.ledger.countFrom(Number(opened.inputSeq));
        this.ledger.resumedAt(Number(opened.inputSeq));
        this.#heardFromServer();
        this.#setConnection("connected");
        this.#send();
      },
      part: (part) => {
        const frame = this.#assembly.add(part);
        if (frame) this.#fitted();
        if (!frame || this.box.put(frame, lane.streamId)) return;
        lane.acknowledge(frame.frameSeq, lane.streamId); // dropped, but its credit is owed
      },
      fault: (fault) => this.watcher.problem(fromFault(fault)),
      goAway: (goAway) => (this.#goAway = goAway),
      ended: (error) => void this.#recover(error, session),
      isQuiet: () => !this.ledger.hasWaiting && !this.ledger.hasInFlight && this.#waitingForFrames === 0,
      resting: () => this.#setConnection("idle"),
    });
    this.#lane = lane;
  }

  /** `session`: which the stream was of. */
  async #recover(ended: LpdeformError | undefined, session: string): Promise<void> {
    if (this.isClosed) return;
    const recovery = recoveryAfter(ended, this.#goAway, this.copy !== undefined);
    this.interruption = recovery.why;
    this.#setConnection("reconnecting");
    if (recovery.why.reason === "FRAME_PARTS" && ++this.#misfits >= mostMisfits) return this.#giveUp(recovery.why);
    if (recovery.next === "giveUp" || this.#isTooLate()) return this.#giveUp(recovery.why);
    await pause(Math.max(recovery.pauseMs, this.#backoff.nextMs()), this.stop.signal);
    if (this.#isOver) return;
    if (recovery.next === "makeAnew") {
      try {
        await this.makeAnew(session);
      } catch (error) {
        if (!(await this.#mayMakeAgain(error as LpdeformError))) return;
      }
    }
    if (!this.#isOver) this.#subscribe();
  }

  #heardFromServer(): void {
    this.#downSince = undefined;
    if (this.#misfits === 0) this.#backoff.reset();
  }

  #fitted(): void {
    if (this.#misfits === 0) return;
    this.#misfits = 0;
    this.#backoff.reset();
  }

  #isTooLate(): boolean {
    this.#downSince ??= performance.now();
    return performance.now() - this.#downSince > this.rpc.reconnectForMs;
  }

  #giveUp(why: LpdeformError): void {
    this.#over = why;
    this.ledger.dropUnaccepted();
    this.#isStreaming = false;
    this.#lane?.close();
    this.#setConnection("closed");
    this.box.finish(why);
    this.#wakeQuiet();
  }

  /** Once for each session that is lost, however many find that out, and however late. */
  makeAnew(lost: string): Promise<void> {
    if (this.#lease.session !== lost) return Promise.resolve();
    this.#making ??= this.#make().finally(() => (this.#making = undefined));
    return this.#making;
  }

  /** After makeAnew() has failed, and the pause that the server asks for. False where it is the end. */
  async #mayMakeAgain(failure: LpdeformError): Promise<boolean> {
    if (isUndecided(failure)) await pause(Math.min(failure.retryAfterMs, longestRetryMs), this.stop.signal);
    else this.#giveUp(failure);
    return isUndecided(failure);
  }

  async #make(): Promise<void> {
    const { mesh, options } = this.copy!;
    this.#lease = await createSession(this.rpc, mesh, options, this.#requestId, this.stop.signal);
    this.#requestId = newRequestId();
    this.ledger.sessionLost();
    this.ledger.countFrom(this.#lease.inputSeq);
    this.box.beginSession();
  }

  // Updates.

  #send(): void {
    while (!this.isClosed && !this.#isSending && this.#solves === 0 && this.ledger.canSend) {
      void this.#sendOne(this.ledger.sendNext());
    }
  }

  async #sendOne(update: NumberedUpdate): Promise<void> {
    const lease = this.#lease;
    // What was on its way when the connection or the session was lost is sent again, whatever becomes of the first time.
    try {
      this.ledger.accept(update, await this.sendUpdate(update, lease, this.stop.signal));
      this.#heardFromServer();
    } catch (thrown) {
      if (this.ledger.isInFlight(update)) await this.#unsent(update, thrown as LpdeformError, lease.session);
    }
    this.#wakeQuiet();
    this.#send();
  }

  /** Whether the update survives the end of the server. */
  async sendUpdate(update: NumberedUpdate, { session, writerToken }: Lease, signal: AbortSignal): Promise<boolean> {
    const packer = new Packer();
    const uploads = new Uploads(this.rpc, signal);
    const message = updateToWire(update.update, update.seq, packer);
    try {
      await packer.flush((bytes) => uploads.add(bytes));
      const { result } = await this.rpc.call("updateHandles", { session, writerToken, update: message }, signal);
      return result?.kept ?? false;
    } finally {
      uploads.discard();
    }
  }

  async #unsent(update: NumberedUpdate, error: LpdeformError, session: string): Promise<void> {
    if (this.isClosed) return;
    if (isUndecided(error)) {
      this.#isSending = true;
      this.ledger.connectionLost();
      try {
        if (this.#isTooLate()) return this.#giveUp(error);
        await pause(Math.max(error.retryAfterMs, this.#backoff.nextMs()), this.stop.signal);
        if (isSessionLost(error)) {
          if (!this.copy) return this.#giveUp(error);
          await this.makeAnew(session);
        }
      } catch (again) {
        await this.#mayMakeAgain(again as LpdeformError);
      } finally {
        this.#isSending = false;
      }
      return;
    }
    if (isTakenAllTheSame(error)) this.ledger.accept(update);
    else this.ledger.refuse(update);
    if (error.reason === "NOT_THE_WRITER") {
      this.ledger.dropUnaccepted();
      this.#lease = { ...this.#lease, writerToken: "" };
      error = new LpdeformError("aborted", "Another writer took the session over.", { reason: "WRITER_REPLACED" });
    }
    this.watcher.problem(error);
  }

  /** Waits until no update is on its way, and keeps others from being sent until the result is called. */
  async holdUpdates(signal: AbortSignal): Promise<() => void> {
    ++this.#solves;
    signal.addEventListener("abort", this.#wakeQuiet, { once: true });
    while ((this.ledger.hasInFlight || this.#isSending) && !this.isClosed && !signal.aborted) {
      await new Promise<void>((resolve) => this.#quiet.add(resolve));
    }
    signal.removeEventListener("abort", this.#wakeQuiet);
    return () => {
      --this.#solves;
      this.#wakeQuiet();
      this.#send();
    };
  }

  /** The same, and until no solve is under way, and nobody else who is alone. */
  async holdAlone(signal: AbortSignal): Promise<() => void> {
    while (this.#solves > 0 && !this.isClosed) await new Promise<void>((resolve) => this.#quiet.add(resolve));
    return this.holdUpdates(signal);
  }

  readonly #wakeQuiet = () => {
    for (const resolve of this.#quiet) resolve();
    this.#quiet.clear();
  };

  #setConnection(state: Connection): void {
    if (this.#connection === state) return;
    this.#connection = state;
    this.watcher.connection(state);
  }
}

export function sessionClosed(): LpdeformError {
  return new LpdeformError("failed_precondition", "The session is closed.", { reason: "SESSION_CLOSED" });
}
