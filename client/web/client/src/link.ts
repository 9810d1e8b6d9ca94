import { FrameAssembly } from "./assembly.js";
import { FrameBox } from "./box.js";
import type { WireFrame } from "./frame.js";
import { fromFault, LpdeformError, sessionClosed, unforeseen } from "./errors.js";
import { noticeFromWire } from "./fromwire.js";
import { Scalar } from "./gen/lpdeform/v1/data_pb.js";
import { Holds } from "./holds.js";
import type { GoAway } from "./gen/lpdeform/v1/service_pb.js";
import type { Lane, WireFrameOptions } from "./hub.js";
import { checkVertexCount, type Copy, joinSession, type Lease } from "./lease.js";
import { Ledger, type NumberedUpdate } from "./ledger.js";
import type { Watcher } from "./listeners.js";
import { Notices } from "./notices.js";
import { type Answer, answerOf, Backoff, RecoveryRules, writerReplaced } from "./recovery.js";
import type { Rpc } from "./rpc.js";
import { sendUpdate } from "./sendupdate.js";
import type { BetterShape, Connection, Frame, FrameShading, FrameUnpacker, Notice, Update } from "./types.js";
import { newRequestId } from "./requestid.js";
import { unpackerFor } from "./unpack.js";
import { isUndecided } from "./verdict.js";
import { Pauses } from "./waiting.js";

/**
 * The inside of a session: the lease on the server's session, the ledger of updates, the box of frames, and the stream of
 * frames that is kept open.
 */
export class Link {
  readonly box = new FrameBox();
  readonly ledger: Ledger;
  readonly stop = new AbortController();
  /** For calls that no update may overtake. */
  readonly holds = new Holds({
    isQuiet: () => !this.ledger.hasInFlight && !this.#isSending,
    isClosed: () => this.isClosed,
    released: () => this.#send(),
  });
  /** Whether the session was lost and all its handles were sent again in one update. */
  isRecreated = false;
  /** What ended the stream of frames the last time. */
  interruption: LpdeformError | undefined;
  #lease: Lease;
  #lane: Lane | undefined;
  #assembly = new FrameAssembly(0);
  /** Set if frames are unpacked, or shaded, before they are taken. */
  #unpacker: FrameUnpacker | undefined;
  #goAway: GoAway | undefined;
  /** Set while no stream is open: the server may continue from an older state. Updates wait until it says which. */
  #mayHaveGoneBack = false;
  /** The newest update when the session ended, which dropped those without an answer. Results of earlier ones do not answer them. */
  #newestDropped = 0;
  #connection: Connection = "idle";
  readonly #notices = new Notices();
  /** How many callers wait for frames even if the page is hidden. */
  #waitingForFrames = 0;
  #isStreaming = false;
  #isSending = false;
  #requestId = newRequestId();
  #making: Promise<void> | undefined;
  /** The newest update that was accepted when the stream was asked for the last time. */
  #asked = 0;
  /** When the present stream was opened. */
  #openedAt: number | undefined;
  #downSince: number | undefined;
  /** The last update that was sent again because the server had lost its uploads. */
  #sentAgain = 0;
  #over: LpdeformError | undefined; // nothing is tried any more, for this reason
  /** Pauses before the next try. */
  readonly #pauses = new Pauses(this.stop.signal);
  readonly #rules: RecoveryRules;
  /** For updates while the server is away. */
  readonly #backoff = new Backoff();

  constructor(
    readonly rpc: Rpc,
    lease: Lease,
    readonly frameOptions: WireFrameOptions,
    readonly copy: Copy | undefined,
    readonly watcher: Watcher,
    readonly shading?: FrameShading,
  ) {
    this.#lease = lease;
    this.ledger = new Ledger(copy?.isBare);
    this.ledger.countFrom(lease.inputSeq);
    this.ledger.beginEpoch(lease.epoch);
    this.#newestDropped = 0;
    this.#rules = new RecoveryRules(copy !== undefined, rpc.reconnectForMs);
  }

  get lease(): Lease {
    return this.#lease;
  }

  get connection(): Connection {
    return this.#connection;
  }

  get notice(): Notice | undefined {
    return this.#notices.last;
  }

  /** Whether nothing is tried, for now or for good. */
  get #isOver(): boolean {
    return this.isClosed || this.#over !== undefined;
  }

  get isClosed(): boolean {
    return this.stop.signal.aborted;
  }

  /** Throws if the session takes no updates from this client. */
  checkWriter(): void {
    if (this.isClosed) throw sessionClosed();
    if (this.#over) throw this.#over;
    if (!this.#lease.writerToken) {
      throw new LpdeformError("failed_precondition", "A reader cannot change the session: takeOver() first.", {
        reason: "NOT_THE_WRITER",
      });
    }
  }

  update(update: Update): number {
    this.checkWriter();
    const seq = this.ledger.add(update);
    this.#lane?.wake();
    this.#send();
    return seq;
  }

  /** Frames come from now on. */
  startStream(): void {
    if (this.#isStreaming || this.#isOver) return;
    this.#isStreaming = true;
    this.#subscribe();
  }

  /** The newest frame that was not taken. Taking it lets the server send more. */
  take(): Frame | undefined {
    const taken = this.box.take();
    if (taken) this.#lane?.acknowledge(taken.frame.frameSeq, taken.streamId);
    return taken?.frame;
  }

  /** The frame taken last, by any caller, if it is the finished result of the newest update. */
  takeResult(): Frame | undefined {
    if (!this.take() && this.box.isClosed) return undefined;
    const last = this.box.lastFinal;
    return last && last.inputSeq >= Math.max(this.ledger.newest, this.#newestDropped) ? last : undefined;
  }

  /** Frames come even if the page is hidden, until the returned function is called. */
  holdStream(): () => void {
    ++this.#waitingForFrames;
    this.startStream();
    this.#lane?.wake();
    return () => --this.#waitingForFrames;
  }

  async close(keepalive = false): Promise<void> {
    if (this.isClosed) return;
    this.stop.abort();
    this.#pauses.end();
    this.#lane?.close();
    this.#setConnection("closed");
    this.box.finish("closed");
    this.holds.wake();
    if (this.copy) await this.rpc.call("deleteSession", { session: this.#lease.session }, undefined, keepalive);
  }

  async takeOver(): Promise<void> {
    if (this.isClosed) throw sessionClosed();
    const lease = await joinSession(this.rpc, this.#lease.session, "writer", this.stop.signal);
    this.#lease = lease;
    this.ledger.countFrom(lease.inputSeq);
    this.ledger.beginEpoch(lease.epoch);
    this.#newestDropped = 0;
    this.box.beginEpoch(lease.epoch);
    this.#over = undefined;
    this.#downSince = undefined;
    this.#rules.begin();
    this.#backoff.reset();
    this.#pauses.end();
    this.box.resume();
    this.#send();
  }

  // The stream.

  /** Unpacks and shades the frame elsewhere; undefined if nothing is to be done. */
  #prepare(frame: WireFrame): Promise<void> | undefined {
    if (frame.packed) return this.#unpacker?.unpack(frame.packed).then((unpacked) => frame.take(unpacked));
    return this.shading?.shade(frame).then((shaded) => void (frame.shaded = shaded));
  }

  #subscribe(): void {
    this.#goAway = undefined;
    const { session } = this.#lease;
    const lane = this.rpc.hub.subscribe(session, this.frameOptions, {
      asked: () => (this.#asked = this.ledger.newestAccepted),
      opened: (opened) => {
        checkVertexCount(opened.vertexCount, this.#lease.report.vertices);
        this.#unpacker = this.shading ?? unpackerFor(opened.vertexCount);
        const isDouble = this.frameOptions.scalar === Scalar.FLOAT64;
        this.#assembly = new FrameAssembly(opened.vertexCount, isDouble, this.#unpacker !== undefined);
        this.#clearNotices(); // they were about an earlier stream
        this.#resumed(Number(opened.epoch), Number(opened.inputSeq));
        this.#openedAt = performance.now();
        this.#downSince = undefined;
        this.#setConnection("connected");
        this.#send();
      },
      part: (part) => {
        const frame = this.#assembly.add(part);
        if (!frame) return;
        const { streamId } = lane;
        const ready = this.#prepare(frame);
        if (!ready) return this.#takeFrame(frame, lane, streamId);
        void ready.then(
          () => {
            if (this.#lane === lane && this.#lease.session === session) this.#takeFrame(frame, lane, streamId);
          },
          (error) => lane.misfit(unforeseen(error)),
        );
      },
      fault: (fault) => {
        const error = fromFault(fault);
        this.#report(error, error.inputSeq, answerOf(error));
      },
      goAway: (goAway) => (this.#goAway = goAway),
      notice: (wire) => {
        const notice = noticeFromWire(wire);
        this.#notices.add(notice);
        this.watcher.notice(notice);
      },
      ended: (error) => void this.#recover(error, session),
      isQuiet: () => !this.ledger.hasWaiting && !this.ledger.hasInFlight && this.#waitingForFrames === 0,
      resting: () => {
        this.#openedAt = undefined;
        this.#downSince = undefined; // nothing is tried meanwhile
        this.#mayHaveGoneBack = true;
        this.#clearNotices();
        this.#setConnection("idle");
      },
    });
    this.#lane = lane;
  }

  /** `streamId`: of the stream on which it came. */
  #takeFrame(frame: WireFrame, lane: Lane, streamId: string): void {
    this.#rules.frameFitted();
    this.ledger.show(frame.epoch, frame.inputSeq);
    if (this.#notices.shown(frame)) this.#tellNotice();
    if (this.box.put(frame, streamId)) return;
    lane.acknowledge(frame.frameSeq, streamId); // dropped, but its credit must be returned
  }

  /** The server's newest update is `inputSeq`. */
  #resumed(epoch: number, inputSeq: number): void {
    this.#mayHaveGoneBack = false;
    this.box.beginEpoch(epoch);
    this.ledger.countFrom(inputSeq);
    this.ledger.reopened(epoch, inputSeq, this.#asked);
  }

  /** `session`: the session that the stream was for. */
  async #recover(ended: LpdeformError | undefined, session: string): Promise<void> {
    if (this.isClosed) return;
    const now = performance.now();
    const stoodMs = this.#openedAt === undefined ? 0 : now - this.#openedAt;
    if (this.#openedAt !== undefined) this.#downSince = undefined; // the server was there until now
    this.#openedAt = undefined;
    const recovery = this.#rules.after({ error: ended, goAway: this.#goAway, stoodMs, awayMs: this.#awayMs() });
    this.interruption = recovery.why;
    this.#mayHaveGoneBack = true;
    this.#clearNotices();
    this.#setConnection("reconnecting");
    if (recovery.next === "giveUp") return this.#giveUp(recovery.why);
    const isTakenOver = await this.#pauses.wait(recovery.pauseMs);
    if (this.#isOver) return;
    if (recovery.next === "recreate" && !isTakenOver) {
      try {
        await this.recreate(session);
      } catch (error) {
        if (!(await this.#mayMakeAgain(error as LpdeformError))) return;
      }
    }
    if (!this.#isOver) this.#subscribe();
  }

  /** Time since the server was last there. */
  #awayMs(): number {
    this.#downSince ??= performance.now();
    return performance.now() - this.#downSince;
  }

  #giveUp(why: LpdeformError): void {
    this.#over = why;
    this.#pauses.end();
    this.#mayHaveGoneBack = false;
    this.#newestDropped = this.ledger.newest;
    this.ledger.dropUnaccepted();
    this.#isStreaming = false;
    this.#lane?.close();
    this.#setConnection("closed");
    this.box.finish(why);
    this.holds.wake();
  }

  /** Recreates a lost session once, however many callers notice the loss, and however late. */
  recreate(lost: string): Promise<void> {
    if (this.#lease.session !== lost) return Promise.resolve();
    this.#making ??= this.#make().finally(() => (this.#making = undefined));
    return this.#making;
  }

  /** After recreate() has failed: waits for the pause that the server asks for. False if it must not be tried again. */
  async #mayMakeAgain(failure: LpdeformError): Promise<boolean> {
    const { next, pauseMs } = this.#rules.afterFailedMaking(failure);
    if (next === "giveUp") this.#giveUp(failure);
    else await this.#pauses.wait(pauseMs);
    return next !== "giveUp";
  }

  async #make(): Promise<void> {
    this.#lease = await this.copy!.make(this.#requestId, this.stop.signal);
    this.#downSince = undefined;
    this.#requestId = newRequestId();
    this.ledger.sessionLost();
    this.isRecreated = this.copy!.isBare && this.ledger.hasRestore;
    this.ledger.countFrom(this.#lease.inputSeq);
    this.ledger.beginEpoch(this.#lease.epoch);
    this.#newestDropped = 0;
    this.box.beginSession();
  }

  // Updates.

  #send(): void {
    while (this.#maySend && this.ledger.canSend) void this.#sendOne(this.ledger.sendNext());
  }

  get #maySend(): boolean {
    return !this.isClosed && !this.#isSending && !this.#mayHaveGoneBack && !this.holds.areThere;
  }

  async #sendOne(update: NumberedUpdate): Promise<void> {
    const lease = this.#lease;
    // An update that was under way when the connection or the session was lost is sent again, whatever
    // happens to the first sending.
    try {
      this.ledger.accept(update, await sendUpdate(this.rpc, lease, update, this.stop.signal));
      this.#downSince = undefined;
      this.#backoff.reset();
    } catch (thrown) {
      if (this.ledger.isInFlight(update)) await this.#unsent(update, thrown as LpdeformError, lease.session);
    }
    this.holds.wake();
    this.#send();
  }

  async #unsent(update: NumberedUpdate, error: LpdeformError, session: string): Promise<void> {
    if (this.isClosed) return;
    const answer = answerOf(error, update.seq === this.#sentAgain);
    if (answer === "again" || answer === "recreate") {
      if (error.reason === "UPLOAD_UNKNOWN") this.#sentAgain = update.seq;
      this.#isSending = true;
      this.ledger.connectionLost();
      // If no stream says what the server has, sending again does no harm.
      if (!this.#isStreaming && error.code !== "resource_exhausted") this.ledger.resumedAt(0);
      try {
        if (error.code === "resource_exhausted" || error.reason === "UPLOAD_UNKNOWN") this.#downSince = undefined;
        if (this.#awayMs() > this.rpc.reconnectForMs) return this.#giveUp(error);
        const isTakenOver = await this.#pauses.wait(this.#backoff.nextMs(error.retryAfterMs));
        if (answer === "recreate" && !isTakenOver) {
          if (!this.copy) return this.#giveUp(error);
          await this.recreate(session);
        }
      } catch (again) {
        await this.#mayMakeAgain(again as LpdeformError);
      } finally {
        this.#isSending = false;
      }
      return;
    }
    this.#downSince = undefined;
    this.#report(this.#judged(update, error, answer), update.seq, answer);
  }

  /** Reports an error, unless it only says that the server cannot solve for the update yet and a newer update is there. */
  #report(why: LpdeformError, seq: number, answer: Answer): void {
    if (answer !== "taken" || seq === 0 || seq >= this.ledger.newest) this.watcher.problem(why);
  }

  /** The error to report for an update that the server refuses or cannot solve for yet. */
  #judged(update: NumberedUpdate, error: LpdeformError, answer: Answer): LpdeformError {
    if (answer === "taken") this.ledger.accept(update);
    else this.ledger.refuse(update);
    if (error.reason !== "NOT_THE_WRITER") return error;
    this.ledger.dropUnaccepted();
    this.#lease = { ...this.#lease, writerToken: "" };
    return writerReplaced();
  }

  /** Sends what a server that went away may have lost, while updates are held back. */
  async sendRestore(signal: AbortSignal): Promise<void> {
    if (this.#mayHaveGoneBack) this.ledger.resumedAt(0);
    while (this.ledger.hasRestore) await this.#sendHeld(signal);
  }

  /** Sends everything that waits, while updates are held back. Rejects if the server is away, and with its errors. */
  async sendWaiting(signal: AbortSignal): Promise<void> {
    await this.sendRestore(signal);
    while (this.ledger.hasWaiting) await this.#sendHeld(signal);
  }

  async #sendHeld(signal: AbortSignal): Promise<void> {
    const update = this.ledger.sendNext();
    try {
      this.ledger.accept(update, await sendUpdate(this.rpc, this.#lease, update, signal));
    } catch (thrown) {
      const error = thrown as LpdeformError;
      if (isUndecided(error)) {
        this.ledger.connectionLost();
        throw error;
      }
      if (!this.ledger.isInFlight(update)) return; // of a session that was lost meanwhile
      const answer = answerOf(error);
      const why = this.#judged(update, error, answer);
      if (answer !== "taken") throw why;
      this.#report(why, update.seq, answer);
    }
  }

  /** Asks once only: if the answer is lost, the shape may have been taken, and then there is no other. */
  async takeBetterShape(signal: AbortSignal): Promise<BetterShape> {
    const { session, writerToken } = this.#lease;
    try {
      const { inputSeq, energy } = await this.rpc.call("takeBetterShape", { session, writerToken }, signal);
      this.forgetBetter();
      return { inputSeq: Number(inputSeq), energy };
    } catch (thrown) {
      const { reason } = thrown as LpdeformError;
      if (reason === "NO_BETTER_SHAPE") this.forgetBetter();
      throw thrown;
    }
  }

  /** The better shape that was announced is not there any more: it was taken, or a solve has ended. */
  forgetBetter(): void {
    if (this.#notices.dropBetter()) this.#tellNotice();
  }

  #clearNotices(): void {
    if (this.#notices.clear()) this.#tellNotice();
  }

  #tellNotice(): void {
    this.watcher.notice(this.#notices.last);
  }

  #setConnection(state: Connection): void {
    if (this.#connection === state) return;
    this.#connection = state;
    this.watcher.connection(state);
  }
}
