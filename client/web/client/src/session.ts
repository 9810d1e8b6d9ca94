import { loadDecompressor } from "./decode.js";
import { LpdeformError, sessionClosed } from "./errors.js";
import { checkVertexCount, type Copy, createSession, joinSession, type Lease, routeOf } from "./lease.js";
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
import { Backoff } from "./recovery.js";
import { Rpc } from "./rpc.js";
import { restoreSnapshot, takeSnapshot } from "./snapshot.js";
import { runSolve } from "./solve.js";
import { frameOptionsToWire } from "./towire.js";
import type {
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
  /** What the server says about itself; undefined where the stream that it was said on has ended. */
  notice: Notice | undefined;
}

/**
 * A mesh being deformed on a server. Functions that return no promise do not wait: changes made faster than the connection
 * takes them are merged, the newest value of each handle and each setting winning.
 *
 * Frames come over a stream that begins when they are first asked for. While it is down, the session reconnects with growing
 * pauses: to the same session where the server still has it, otherwise to a new one that it makes from its own copy of mesh,
 * handles and settings. Frames of an older epoch or an older update than one that was shown are dropped.
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
    this.#link = new Link(rpc, lease, frameOptionsToWire(frameOptions), copy, {
      problem: (error) => [...this.#listeners.problem].forEach((listener) => tell(listener, error)),
      connection: (state) => [...this.#listeners.connection].forEach((listener) => tell(listener, state)),
      notice: (notice) => [...this.#listeners.notice].forEach((listener) => tell(listener, notice)),
    });
  }

  /** "sessions/<32 hexadecimal digits>"; another one after the session had to be made anew. */
  get name(): string {
    return this.#link.lease.session;
  }

  /** What the server found in the mesh. */
  get meshReport(): MeshReport {
    return this.#link.lease.report;
  }

  get connection(): Connection {
    return this.#link.connection;
  }

  /** Why it is "reconnecting", or was the last time: DRAINING where the server shuts down. */
  get interruption(): LpdeformError | undefined {
    return this.#link.interruption;
  }

  /** What the server said about itself last, on the stream of frames that there is; undefined where it said nothing. */
  get notice(): Notice | undefined {
    return this.#link.notice;
  }

  /** The newest update that was not refused; 0 where there is none. */
  get newestInput(): number {
    return this.#link.ledger.newest;
  }

  /** Calls `listener` at each such event, until the returned function is called. */
  on<Name extends keyof SessionEvents>(name: Name, listener: (event: SessionEvents[Name]) => void): () => void {
    const listeners = this.#listeners[name] as Set<typeof listener>;
    listeners.add(listener);
    return () => listeners.delete(listener);
  }

  /**
   * Sends a change and returns its number: a frame whose inputSeq is at least that takes it into account. What the server
   * refuses comes as a "problem", once; the session goes on without it. Throws once closed or over, for a reader, and for
   * a key or a word that it does not know (UNKNOWN_KEY).
   */
  update(update: Update): number {
    checkUpdate(update);
    return this.#link.update(update);
  }

  /** Adds handles or replaces those of the same names. As update(). */
  setHandles(handles: Readonly<Record<string, Handle>>): number {
    const changes = Object.entries(handles).map(([name, handle]) => [name, { set: handle }] as const);
    return this.update({ handles: Object.fromEntries(changes) });
  }

  setHandle(name: string, handle: Handle): number {
    return this.update({ handles: { [name]: { set: handle } } });
  }

  /** Moves a handle. As update(). */
  move(name: string, motion: Motion): number {
    return this.update({ handles: { [name]: { move: motion } } });
  }

  /** Lets go of a handle. As update(). */
  remove(name: string): number {
    return this.update({ handles: { [name]: { remove: true } } });
  }

  /** Changes p, stiffness, method and so on. As update(). */
  set(settings: Settings): number {
    return this.update({ settings });
  }

  /**
   * The newest frame not yet taken, where there is one. Taking a frame, here or by iterating, tells the server to send on, so
   * a reader who stops asking costs a bounded number of frames. Throws why, once nothing more comes.
   */
  poll(): Frame | undefined {
    this.#link.startStream();
    return this.#link.take();
  }

  /** Frames as they come, the newest first, until the session is closed. Throws why, where the session is over otherwise. */
  async *[Symbol.asyncIterator](): AsyncGenerator<Frame, void, undefined> {
    const next = () => this.#waitFor(() => this.#link.take());
    for (let frame = await next(); frame; frame = await next()) yield frame;
  }

  /**
   * The finished result of the newest update. Takes frames until it is there; at once, also with a timeout of 0, where the
   * newest frame that was taken before, here or by poll() or by iterating, is that result: also while the connection is down.
   * Rejects with the first "problem".
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

  /** What `ask` returns as soon as that is something; nothing where the session is closed. */
  async #waitFor(ask: () => Frame | undefined, signal?: AbortSignal): Promise<Frame | undefined> {
    const { box } = this.#link;
    this.#link.startStream();
    for (;;) {
      const { takes } = box;
      if (signal?.reason instanceof LpdeformError) throw signal.reason; // what the server refuses comes before any result
      const frame = ask();
      if (frame || box.isClosed) return frame;
      if (signal?.aborted) throw abortReason(signal, "No new frame came in time.", "NO_FRAME");
      await box.wait(takes, signal);
    }
  }

  /**
   * Solves for the present handles and settings on the server and returns the finished result. Works beside the stream of
   * frames. Begins again where the server went away, for as long as the stream would. Rejects with what the server refuses.
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
          await unlessAborted(link.makeAnew(lost), signal);
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
        else if (lost === undefined) link.ledger.resumedAt(0); // it may have gone back: once more does no harm
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
      const result = await runSolve(rpc, lease, update, options, end, signal);
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
   * Takes the newest step of the handles back on the server, or does again what was taken back last: see
   * Update.beginsStep. After all updates before it, and after solves that are under way. Resolves with the number of the
   * update that this is, when the server has it; frames show what comes of it. Rejects with FAILED_PRECONDITION
   * (NOTHING_TO_UNDO, NOTHING_TO_REDO), ABORTED (INPUT_SEQ_PASSED) where another update came before it, DEADLINE_EXCEEDED
   * where the server stays away. A session that had to be made anew knows no steps from before: NOT_FOUND where that
   * happens meanwhile, NOTHING_TO_UNDO afterwards.
   */
  undo(options: { signal?: AbortSignal } = {}): Promise<number> {
    return this.#step(false, options);
  }

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
   * The session as a file: mesh, handles, settings, what can be undone and the surface as it is, but not who writes. The session
   * goes on meanwhile. For restoreSession(), on any server of the same version or a later one.
   */
  async snapshot(options: { signal?: AbortSignal } = {}): Promise<Uint8Array<ArrayBuffer>> {
    checkCallOptions(options, "signal");
    const { isClosed, rpc, lease, stop } = this.#link;
    if (isClosed) throw sessionClosed();
    const signal = AbortSignal.any([stop.signal, options.signal].filter((one) => one !== undefined));
    return takeSnapshot(rpc, lease.session, signal);
  }

  /** Becomes the writer in place of whoever is, as a reader or after a WRITER_REPLACED. */
  takeOver(): Promise<void> {
    return this.#link.takeOver();
  }

  /** Ends the stream and every waiting call. Deletes the session on the server where openSession() made it. */
  close(): Promise<void> {
    return this.#link.close();
  }
}

/** Makes a session on the server. Rejects with the first element of the mesh that cannot be deformed. */
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
 * Makes a session from a file of Session.snapshot(): the same surface to the last bit, under a new name, with the caller as its
 * writer. Where the server loses it, it is made anew from the file, which must not change, and from what came after.
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

/** Joins somebody's session by name. It is not made anew where the server loses it, and not deleted by close(). */
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

/** Loads what frames are decompressed with, where any may come. */
async function prepareFor({ encoding, lowestEncoding }: FrameOptions): Promise<void> {
  if (encoding === "compressed" || lowestEncoding === "compressed") await loadDecompressor();
}

/** What timers take. */
function timerMs(milliseconds: number): number {
  return Math.min(Math.max(Math.ceil(milliseconds), 0), 2 ** 31 - 1);
}

/** `text` and `reasonOfLate`: of running out of time. */
function abortReason({ reason }: AbortSignal, text: string, reasonOfLate = ""): LpdeformError {
  if (reason instanceof LpdeformError) return reason;
  const isLate = reason instanceof DOMException && reason.name === "TimeoutError";
  return isLate
    ? new LpdeformError("deadline_exceeded", text, { reason: reasonOfLate })
    : new LpdeformError("cancelled", "The call was aborted.", {}, reason);
}
