import { loadDecompressor } from "./decode.js";
import { LpdeformError, sessionClosed } from "./errors.js";
import { checkVertexCount, type Copy, createSession, joinSession, type Lease, routeOf } from "./lease.js";
import { checkWord } from "./key_checks.js";
import {
  checkCallOptions,
  checkJoinOptions,
  checkMesh,
  checkOpenOptions,
  checkRestoreOptions,
  checkSolveOptions,
  checkUpdate,
} from "./keys.js";
import { Link } from "./link.js";
import { tell } from "./listeners.js";
import type { Reason } from "./reasons.js";
import { Backoff } from "./recovery.js";
import { Rpc } from "./rpc.js";
import { restoreSnapshot, takeSnapshot } from "./snapshot.js";
import { meshIn } from "./snapshot_mesh.js";
import { runSolve } from "./solve.js";
import { frameOptionsToWire } from "./towire.js";
import type {
  BetterShape,
  Connection,
  DoubleSolveOptions,
  Frame,
  FrameOptions,
  Handle,
  JoinOptions,
  Mesh,
  MeshReport,
  Motion,
  Notice,
  OpenOptions,
  RestMesh,
  RestoreOptions,
  Settings,
  SolveOptions,
  SolveResult,
  Update,
} from "./types.js";
import { takeStep } from "./undo.js";
import { newRequestId } from "./requestid.js";
import { isSessionLost, isTakenAllTheSame, isUndecided } from "./verdict.js";
import { pause, unlessAborted } from "./waiting.js";

export interface SessionEvents {
  /** The server refused an update, or cannot solve for it yet; the session goes on. */
  problem: LpdeformError;
  connection: Connection;
  /**
   * Each notice as it comes. If a notice no longer applies, what `Session.notice` then has: undefined if the stream has ended.
   */
  notice: Notice | undefined;
}

/**
 * A mesh that is deformed on a server. Functions that return no promise do not wait. Changes that come faster than the
 * connection takes them are coalesced: the newest value of each handle and each setting wins.
 *
 * Frames come over a stream that begins when they are first requested. If it breaks, the session reconnects with growing
 * pauses: to the same session if the server still has it, otherwise to a new one that it creates from its own copy of mesh,
 * handles and settings. Frames of an older epoch or an older update than an earlier frame are dropped.
 */
export class Session implements AsyncIterable<Frame> {
  readonly #link: Link;
  readonly #listeners = {
    problem: new Set<(e: LpdeformError) => void>(),
    connection: new Set<(c: Connection) => void>(),
    notice: new Set<(n: Notice | undefined) => void>(),
  };

  /** @internal openSession() and joinSession() make sessions. */
  constructor(rpc: Rpc, lease: Lease, frameOptions: FrameOptions, copy: Copy | undefined) {
    this.#link = new Link(
      rpc,
      lease,
      frameOptionsToWire(frameOptions),
      copy,
      {
        problem: (error) => [...this.#listeners.problem].forEach((listener) => tell(listener, error)),
        connection: (state) => [...this.#listeners.connection].forEach((listener) => tell(listener, state)),
        notice: (notice) => [...this.#listeners.notice].forEach((listener) => tell(listener, notice)),
      },
      frameOptions.shading,
    );
  }

  /** "sessions/<32 hexadecimal digits>"; it changes when the session has to be recreated. */
  get name(): string {
    return this.#link.lease.session;
  }

  /** What the server reported of the mesh. */
  get meshReport(): MeshReport {
    return this.#link.lease.report;
  }

  get connection(): Connection {
    return this.#link.connection;
  }

  /** Why the session is "reconnecting", or was the last time: DRAINING if the server shuts down. */
  get interruption(): LpdeformError | undefined {
    return this.#link.interruption;
  }

  /**
   * The notice of a better shape for as long as it applies: until it is taken, a frame for a later update comes, or a solve() ends.
   * Otherwise the last notice of the server about itself on the present stream; undefined if there was none.
   */
  get notice(): Notice | undefined {
    return this.#link.notice;
  }

  /** The newest update that was not refused; 0 if there is none. */
  get newestInput(): number {
    return this.#link.ledger.newest;
  }

  /** Calls `listener` at each such event, until the returned function is called. Throws for an unknown name (UNKNOWN_KEY). */
  on<Name extends keyof SessionEvents>(name: Name, listener: (event: SessionEvents[Name]) => void): () => void {
    checkWord(name, this.#listeners, "event");
    const listeners = this.#listeners[name] as Set<typeof listener>;
    listeners.add(listener);
    return () => listeners.delete(listener);
  }

  /**
   * Sends a change and returns its number. A frame whose inputSeq is at least that number takes the change into account. If the
   * server refuses the change, a "problem" comes, once; the session goes on without the change. Throws if the session is closed
   * or has ended, for a reader, and for an unknown key or word (UNKNOWN_KEY).
   */
  update(update: Update): number {
    checkUpdate(update);
    return this.#link.update(update);
  }

  /** Adds handles, or replaces those with the same names. Throws as update(). */
  setHandles(handles: Readonly<Record<string, Handle>>): number {
    const changes = Object.entries(handles).map(([name, handle]) => [name, { set: handle }] as const);
    return this.update({ handles: Object.fromEntries(changes) });
  }

  setHandle(name: string, handle: Handle): number {
    return this.update({ handles: { [name]: { set: handle } } });
  }

  /** Moves a handle. Throws as update(). */
  move(name: string, motion: Motion): number {
    return this.update({ handles: { [name]: { move: motion } } });
  }

  /** Removes a handle. Throws as update(). */
  remove(name: string): number {
    return this.update({ handles: { [name]: { remove: true } } });
  }

  /** Changes p, stiffness, method and so on. Throws as update(). */
  set(settings: Settings): number {
    return this.update({ settings });
  }

  /**
   * The newest frame that was not taken, if there is one. Taking a frame, here or by iterating, lets the server send more, so a
   * reader that stops asking costs a bounded number of frames. When nothing more comes, throws the reason.
   */
  poll(): Frame | undefined {
    this.#link.startStream();
    return this.#link.take();
  }

  /** Frames as they come, the newest first, until the session is closed. If the session ended otherwise, throws the reason. */
  async *[Symbol.asyncIterator](): AsyncGenerator<Frame, void, undefined> {
    const next = () => this.#waitFor(() => this.#link.take());
    for (let frame = await next(); frame; frame = await next()) yield frame;
  }

  /**
   * The finished result of the newest update. Takes frames until it comes. Resolves at once, even with a timeout of 0 or
   * without a connection, if the last frame taken, here or by poll() or by iterating, is that result. Rejects with the first
   * "problem".
   */
  async settle(options: { timeoutMs?: number; signal?: AbortSignal } = {}): Promise<Frame> {
    checkCallOptions(options, "timeoutMs", "signal");
    const signals = [options.signal, options.timeoutMs !== undefined && AbortSignal.timeout(options.timeoutMs)];
    const problem = new AbortController();
    const stopListening = this.on("problem", (error) => problem.abort(error));
    const signal = AbortSignal.any([problem.signal, ...signals.filter((one) => one instanceof AbortSignal)]);
    const release = this.#link.holdStream();
    try {
      const frame = await this.#waitFor(() => this.#link.takeResult(), signal);
      if (!frame) throw sessionClosed();
      return frame;
    } finally {
      release();
      stopListening();
    }
  }

  /** Waits until `ask` returns something; undefined if the session is closed. */
  async #waitFor(ask: () => Frame | undefined, signal?: AbortSignal): Promise<Frame | undefined> {
    const { box } = this.#link;
    this.#link.startStream();
    for (;;) {
      const { takes } = box;
      if (signal?.reason instanceof LpdeformError) throw signal.reason; // an error of the server takes precedence over any result
      const frame = ask();
      if (frame || box.isClosed) return frame;
      if (signal?.aborted) throw abortReason(signal, "No new frame came in time.", "NO_FRAME");
      await box.wait(takes, signal);
    }
  }

  /**
   * Solves for the present handles and settings on the server, and returns the finished result. Works in parallel to the stream
   * of frames. If the server goes away, the solve starts again, for as long as the stream would. Rejects with the server's
   * errors.
   */
  solve(options: DoubleSolveOptions): Promise<SolveResult<Float64Array>>;
  solve(options?: SolveOptions): Promise<SolveResult>;
  async solve(options: SolveOptions | DoubleSolveOptions = {}): Promise<SolveResult<Float32Array | Float64Array>> {
    const link = this.#link;
    checkSolveOptions(options);
    if (link.isClosed) throw sessionClosed();
    const { deadlineMs } = options;
    const end = deadlineMs === undefined ? undefined : performance.now() + deadlineMs;
    const late = deadlineMs === undefined ? undefined : AbortSignal.timeout(timerMs(deadlineMs));
    const signal = AbortSignal.any([link.stop.signal, late, options.signal].filter((one) => one !== undefined));
    const release = await link.holds.updates(signal);
    try {
      return await this.#solveUntilDone(options, end, signal);
    } catch (error) {
      throw signal.aborted ? abortReason(signal, "The result did not come in time.") : error;
    } finally {
      release();
    }
  }

  /** `end`: on the clock of performance.now(). */
  async #solveUntilDone(
    options: SolveOptions | DoubleSolveOptions,
    end: number | undefined,
    signal: AbortSignal,
  ): Promise<SolveResult<Float32Array | Float64Array>> {
    const link = this.#link;
    const backoff = new Backoff();
    let latest: number | undefined;
    let lost: string | undefined;
    for (;;) {
      signal.throwIfAborted();
      let { lease } = link;
      try {
        if (lost !== undefined) {
          await unlessAborted(link.recreate(lost), signal);
          lost = undefined;
          lease = link.lease;
        }
        return await this.#solveOnce(lease, options, end, signal);
      } catch (thrown) {
        signal.throwIfAborted();
        const error = thrown as LpdeformError;
        const isPassing = lost === undefined ? error.code === "unavailable" : isUndecided(error);
        if (link.copy && isSessionLost(error)) lost ??= lease.session;
        else if (!isPassing) throw error;
        else if (lost === undefined) link.ledger.resumedAt(0); // the server may have gone back; sending twice does no harm
        latest ??= performance.now() + link.rpc.reconnectForMs;
        if (performance.now() > latest) throw error;
        await pause(backoff.nextMs(error.retryAfterMs), signal);
      }
    }
  }

  async #solveOnce(
    lease: Lease,
    options: SolveOptions | DoubleSolveOptions,
    end: number | undefined,
    signal: AbortSignal,
  ): Promise<SolveResult<Float32Array | Float64Array>> {
    const { ledger, rpc } = this.#link;
    await this.#link.sendRestore(signal);
    const update = ledger.hasWaiting ? ledger.sendNext() : undefined;
    const { newest } = ledger;
    try {
      const result = await runSolve(rpc, lease, update, options, end, signal, () => this.#link.forgetBetter());
      if (update) ledger.accept(update);
      if (result.inputSeq < newest) ledger.resumedAt(result.inputSeq);
      if (result.inputSeq >= newest || !ledger.hasRestore) return result;
    } catch (thrown) {
      const error = thrown as LpdeformError;
      if (update && isTakenAllTheSame(error)) ledger.accept(update);
      else if (update && isUndecided(error)) ledger.connectionLost();
      else if (update) ledger.refuse(update);
      throw error;
    }
    throw new LpdeformError("unavailable", "The server went back to an earlier state.");
  }

  /**
   * Undoes the newest step of the handles on the server: see Update.beginsStep. The call is sent after all earlier updates and
   * after solves under way. Resolves with the number of the update that the undo is, when the server has it; frames show the
   * result. Rejects with FAILED_PRECONDITION (NOTHING_TO_UNDO, NOTHING_TO_REDO), with ABORTED (INPUT_SEQ_PASSED) if another
   * update came first, and with DEADLINE_EXCEEDED if the server stays away. A recreated session knows no earlier steps:
   * NOT_FOUND if it is lost during the call, NOTHING_TO_UNDO afterwards.
   */
  undo(options: { signal?: AbortSignal } = {}): Promise<number> {
    return this.#step(false, options);
  }

  /** Redoes the step that was undone last. As undo(). */
  redo(options: { signal?: AbortSignal } = {}): Promise<number> {
    return this.#step(true, options);
  }

  async #step(redo: boolean, options: { signal?: AbortSignal }): Promise<number> {
    checkCallOptions(options, "signal");
    const link = this.#link;
    link.checkWriter();
    const late = AbortSignal.timeout(link.rpc.callTimeoutMs);
    const signal = AbortSignal.any([link.stop.signal, late, options.signal].filter((one) => one !== undefined));
    try {
      return await takeStep(link, redo, signal);
    } catch (error) {
      throw signal.aborted ? abortReason(signal, "The server did not answer in time.") : error;
    }
  }

  /**
   * Shows the better shape that the notice "better_shape" has announced, as a new final frame for the same update. The shape is
   * not part of the steps for undo(). Rejects with FAILED_PRECONDITION (NO_BETTER_SHAPE) if none is known for the newest update,
   * as after solve(), which makes the session forget it and search again. The call is not repeated: after UNAVAILABLE or
   * DEADLINE_EXCEEDED the shape may have been taken, which a frame then shows.
   */
  async takeBetterShape(options: { signal?: AbortSignal } = {}): Promise<BetterShape> {
    checkCallOptions(options, "signal");
    const link = this.#link;
    link.checkWriter();
    const signal = AbortSignal.any([link.stop.signal, options.signal].filter((one) => one !== undefined));
    try {
      return await link.takeBetterShape(signal);
    } catch (error) {
      throw signal.aborted ? abortReason(signal, "The server did not answer in time.") : error;
    }
  }

  /**
   * The session as a file: mesh, handles, settings with every earlier change, steps to undo and the present surface, but not the
   * writer. The session goes on meanwhile. For restoreSession(), on any server of the same or a later version.
   */
  async snapshot(options: { signal?: AbortSignal } = {}): Promise<Uint8Array<ArrayBuffer>> {
    checkCallOptions(options, "signal");
    const link = this.#link;
    if (link.isClosed) throw sessionClosed();
    const signal = AbortSignal.any([link.stop.signal, options.signal].filter((one) => one !== undefined));
    const release = await link.holds.updates(signal);
    try {
      await link.sendWaiting(signal);
    } finally {
      release();
    }
    return takeSnapshot(link.rpc, link.lease.session, signal);
  }

  /**
   * The mesh that the session deforms, at rest, in the order of its frames: for those who have joined it. The server sends a whole
   * snapshot for that. Rejects with DATA_LOSS (SNAPSHOT_INCOMPLETE) and with INVALID_ARGUMENT (SNAPSHOT_DAMAGED, and SNAPSHOT_NEWER
   * if the server is of a later version).
   */
  async mesh(options: { signal?: AbortSignal } = {}): Promise<RestMesh> {
    return meshIn(await this.snapshot(options));
  }

  /**
   * Resolves when the server has answered a call that changes nothing. A page can tell by it, sooner than by the silence of the
   * stream, that a server or a proxy has stopped. Rejects with the server's errors, and with DEADLINE_EXCEEDED.
   */
  async ping(options: { signal?: AbortSignal } = {}): Promise<void> {
    checkCallOptions(options, "signal");
    const { isClosed, rpc, lease, stop } = this.#link;
    if (isClosed) throw sessionClosed();
    const signal = AbortSignal.any([stop.signal, options.signal].filter((one) => one !== undefined));
    await rpc.call("getSession", { session: lease.session }, signal);
  }

  /** Becomes the writer in place of the present one, as a reader or after a WRITER_REPLACED. */
  takeOver(): Promise<void> {
    return this.#link.takeOver();
  }

  /**
   * Ends the stream and every waiting call. Deletes the session on the server if openSession() created it. `keepalive`: also if the
   * page is just being left, in a listener to "pagehide".
   */
  close(options: { keepalive?: boolean } = {}): Promise<void> {
    checkCallOptions(options, "keepalive");
    return this.#link.close(options.keepalive);
  }
}

/** Creates a session on the server. Rejects with the first element of the mesh that cannot be deformed. */
export async function openSession(mesh: Mesh, options: OpenOptions = {}): Promise<Session> {
  return openWith(Rpc.connect(options), mesh, options);
}

/** @internal */
export async function openWith(rpc: Rpc, mesh: Mesh, options: OpenOptions): Promise<Session> {
  checkOpenOptions(options);
  checkMesh(mesh);
  await prepareFor(options);
  const lease = await createSession(rpc, mesh, options, newRequestId(), options.signal);
  const make: Copy["make"] = (requestId, signal) => createSession(rpc, mesh, options, requestId, signal);
  return new Session(rpc, lease, options, { make, isBare: true });
}

/**
 * Creates a session from a file of Session.snapshot(): the same surface to the last bit, under a new name, with the caller as
 * its writer. If the server loses the session, it is recreated from the file, which must not change, and the later changes.
 * Rejects with INVALID_ARGUMENT (SNAPSHOT_FOREIGN, SNAPSHOT_NEWER, SNAPSHOT_TRUNCATED, SNAPSHOT_DAMAGED).
 */
export async function restoreSession(snapshot: Uint8Array, options: RestoreOptions = {}): Promise<Session> {
  return restoreWith(Rpc.connect(options), snapshot, options);
}

/** @internal */
export async function restoreWith(rpc: Rpc, snapshot: Uint8Array, options: RestoreOptions): Promise<Session> {
  checkRestoreOptions(options);
  await prepareFor(options);
  const lease = await restoreSnapshot(rpc, snapshot, newRequestId(), options.signal);
  const make: Copy["make"] = async (requestId, signal) => {
    const renewed = await restoreSnapshot(rpc, snapshot, requestId, signal);
    checkVertexCount(renewed.report.vertices, lease.report.vertices);
    return renewed;
  };
  return new Session(rpc, lease, options, { make, isBare: false });
}

/** Joins an existing session by name. It is not recreated if the server loses it, and close() does not delete it. */
export async function joinSessionByName(name: string, options: JoinOptions = {}): Promise<Session> {
  return joinWith(Rpc.connect(options), name, options);
}

/** @internal */
export async function joinWith(rpc: Rpc, name: string, options: JoinOptions): Promise<Session> {
  checkJoinOptions(options);
  await prepareFor(options);
  const role = options.role ?? "reader";
  try {
    const lease = await joinSession(rpc, name, role, options.signal);
    return new Session(lease.route ? rpc.goingBy(lease.route) : rpc, lease, options, undefined);
  } catch (error) {
    const route = routeOf(error as LpdeformError);
    const there = route ? rpc.goingBy(route) : rpc;
    if (there === rpc) throw error;
    return new Session(there, await joinSession(there, name, role, options.signal), options, undefined);
  }
}

/** Loads the decoder if compressed frames may come. */
async function prepareFor({ encoding, lowestEncoding }: FrameOptions): Promise<void> {
  if (encoding === "compressed" || lowestEncoding === "compressed") await loadDecompressor();
}

/** Limits a time to what timers accept. */
function timerMs(milliseconds: number): number {
  return Math.min(Math.max(Math.ceil(milliseconds), 0), 2 ** 31 - 1);
}

/** `text` and `reasonOfLate` describe a timeout. */
function abortReason({ reason }: AbortSignal, text: string, reasonOfLate: Reason = ""): LpdeformError {
  if (reason instanceof LpdeformError) return reason;
  const isLate = reason instanceof DOMException && reason.name === "TimeoutError";
  return isLate
    ? new LpdeformError("deadline_exceeded", text, { reason: reasonOfLate })
    : new LpdeformError("cancelled", "The call was aborted.", {}, reason);
}
