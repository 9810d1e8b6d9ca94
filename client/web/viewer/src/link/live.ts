import {
  Backoff,
  type BetterShapeNotice,
  type Encoding,
  type Frame,
  type FrameShading,
  LpdeformError,
  type MeshReport,
  type MinimaSearch,
  type Notice,
  openSession,
  type Session,
  type SolveResult,
  joinSession,
  type Update,
  type Weld,
} from "lpdeform-client";
import { changes, exponent, newSession, type Side } from "../model/changes.js";
import type { Document } from "../model/document.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { usualSearch } from "../model/view.js";
import { Meter } from "./meter.js";
import { Pulse } from "./pulse.js";
import { failingHere, isPassing, notAnswering, say, type Status, statusAtEnd, statusOf } from "./status.js";
import { watchedStatus } from "./watched.js";

export interface LiveWatcher {
  /** A frame waits to be taken. */
  frame(): void;
  status(status: Status): void;
  report(report: MeshReport): void;
  /** An update was refused, or cannot be solved for yet. */
  problem(error: LpdeformError): void;
  /** What the server says about itself. */
  notice(text: string): void;
  /** Live.better may have changed. */
  better(): void;
}

const live = say("live", "Live");
/** How often in a row the page itself may fail with frames before it stops trying; a session of this length ends the row. */
const mostFailures = 8;
const steadyMs = 30_000;
/** Frames answer one of the newest inputs, so no more are needed. */
const mostExponents = 100;
const mostSent = 1000;

/**
 * A document on the server, and its surface as it comes. The server may go away at any time; the document is sent again when
 * the server is back. A frame is taken when it is drawn, which lets the server send more: a page that draws slowly gets fewer
 * frames.
 */
export class Live {
  readonly meter = new Meter();
  /** The document that the newest frame answers. */
  answered: Document | undefined;
  status: Status = say("idle", "");
  #session: Session | undefined;
  #told = newSession;
  #search = usualSearch;
  #toldSearch = usualSearch;
  #waiting: Frame | undefined;
  #taken: (() => void) | undefined;
  #inputs: { seq: number; time: number; sent: number }[] = [];
  #said: Notice | undefined;
  #isTakingBetter = false;
  #newest = 0;
  #drawn = 0;
  /** p for each input that changed it. */
  #exponents: { seq: number; p: number }[] = [];
  /** The documents of the newest updates, from the one that the newest frame answers on. */
  #sent: { seq: number; document: Document }[] = [];
  /** For sessions that cannot be opened or break at once: by the client's rules, in addition to what the server asks for. */
  readonly #backoff = new Backoff();
  #failures = 0;
  readonly #over = new AbortController();
  readonly #pulse: Pulse;

  constructor(
    readonly mesh: Mesh,
    public document: Document,
    readonly side: Side,
    readonly encoding: Encoding,
    readonly watcher: LiveWatcher,
    /** Which vertices count as one. */
    readonly weld?: Weld,
    /** Somebody else's session, which is only shown. */
    readonly watched?: string,
    /** Finds what is drawn of frames; undefined if the page does. */
    readonly shading?: FrameShading,
  ) {
    this.#pulse = new Pulse(
      async () => this.#session?.ping(),
      () => this.#setStatus(this.#pulse.isSilent ? notAnswering : live),
    );
    void this.#run();
  }

  /** `time`: of the input that made this change, to measure the latency. */
  show(document: Document, time = performance.now()): void {
    this.document = document;
    this.#tell(time);
  }

  /** How far the server is to look for lower minima. */
  lookFor(search: MinimaSearch): void {
    this.#search = search;
    this.#tell(performance.now());
  }

  /** The newest frame, to be drawn at once. */
  take(): Frame | undefined {
    const frame = this.#waiting;
    if (!frame) return undefined;
    this.#waiting = undefined;
    const newer = this.#poll();
    this.#taken?.();
    this.#answer(newer ?? frame);
    return newer ?? frame;
  }

  /** Undefined while the server has none. */
  get sessionName(): string | undefined {
    return this.#session?.name;
  }

  #answer({ inputSeq }: Frame): void {
    const newest = this.#sent.findLastIndex(({ seq }) => seq <= inputSeq);
    if (newest > 0) this.#sent.splice(0, newest);
    if (newest >= 0) this.answered = this.#sent[0]!.document;
  }

  /** A frame that has come since. */
  #poll(): Frame | undefined {
    try {
      return this.#session?.poll();
    } catch {
      return undefined; // the session has ended; reading frames tells why
    }
  }

  /** The frame that was taken is on the screen since `time`. */
  drawn(frame: Frame, time: number): void {
    this.meter.drawn(time, frame.wireBytes);
    this.#drawn = frame.inputSeq;
    let answered = 0;
    for (const { seq, time: asked, sent } of this.#inputs) {
      if (seq > frame.inputSeq) break;
      this.meter.answered(time - asked, frame.receivedAt - sent);
      ++answered;
    }
    this.#inputs.splice(0, answered);
  }

  /** p of the input that the frame answers; see exponent(). */
  exponentOf({ inputSeq }: Frame): number {
    return this.#exponents.findLast(({ seq }) => seq <= inputSeq)?.p ?? 2;
  }

  /** The number of the newest change; 0 if there is none. */
  get newestInput(): number {
    return this.#newest;
  }

  /** Whether there are changes that no picture answers yet. */
  get isSettling(): boolean {
    return this.#newest > this.#drawn;
  }

  /**
   * The result for the document in the doubles that the server computes: the minimum that is shown, from which the server does not search.
   * Rejects if the server is away, has nothing to solve, or takes longer than `deadlineMs`.
   */
  async solve(deadlineMs: number): Promise<SolveResult<Float64Array>> {
    const session = this.#session;
    if (!session || this.status.kind !== "live") throw new LpdeformError("unavailable", this.status.title);
    const wanted = this.#search;
    const none: MinimaSearch = { ...wanted, effort: 0 };
    if (wanted.effort) this.lookFor(none);
    try {
      return await session.solve({ scalar: "float64", deadlineMs, signal: AbortSignal.timeout(deadlineMs) });
    } finally {
      if (this.#search === none) this.lookFor(wanted);
    }
  }

  /** A shape of lower energy for the present document; undefined if none is known, or as soon as it is being taken. */
  get better(): BetterShapeNotice | undefined {
    const session = this.#session;
    const notice = session?.notice;
    if (notice?.reason !== "better_shape" || this.#isTakingBetter) return undefined;
    return notice.inputSeq >= session!.newestInput ? notice : undefined;
  }

  /** Frames show it. */
  async takeBetter(): Promise<void> {
    if (!this.better) return;
    this.#isTakingBetter = true;
    this.watcher.better();
    try {
      await this.#session!.takeBetterShape();
    } catch (thrown) {
      this.watcher.notice((thrown as LpdeformError).message);
    } finally {
      this.#isTakingBetter = false;
      this.watcher.better();
    }
  }

  #say(notice: Notice | undefined): void {
    if (notice && notice.reason !== "better_shape" && notice !== this.#said) {
      this.#said = notice;
      this.watcher.notice(notice.text);
    }
    this.watcher.better();
  }

  /** `isPageLeft`: the server is told even if the page is there no longer. */
  close(isPageLeft = false): void {
    this.#over.abort();
    this.#pulse.stop();
    this.#taken?.();
    this.#session?.close({ keepalive: isPageLeft }).catch(() => undefined); // the session expires by itself if the server is away
    this.#session = undefined;
  }

  async #run(): Promise<void> {
    await new Promise((begin) => setTimeout(begin)); // the task that has opened the mesh has done enough
    while (!this.#over.signal.aborted) {
      const session = await this.#open();
      if (!session) return;
      this.#session = session;
      this.#told = newSession;
      this.#toldSearch = usualSearch;
      this.#inputs = [];
      this.#exponents = [];
      this.#sent = [];
      this.answered = undefined;
      this.#newest = this.#drawn = 0;
      this.watcher.report(session.meshReport);
      session.on("problem", (error) => this.watcher.problem(error));
      session.on("connection", () => this.#connection());
      session.on("notice", (notice) => this.#say(notice));
      this.#tell(performance.now());
      const openedAt = performance.now();
      const { hadFrames, error } = await this.#readFrames(session);
      if (this.#over.signal.aborted) return;
      // A server that opens sessions but gives no frames, or breaks at once, must not be sent the mesh again
      // and again, nor may one whose frames this page fails with.
      const isOwnFault = error?.reason === "EXCEPTION";
      if (hadFrames && performance.now() - openedAt >= (isOwnFault ? steadyMs : Backoff.mostMs)) {
        this.#backoff.reset();
        this.#failures = 0;
      }
      if (isOwnFault) ++this.#failures;
      if (error) this.#end(session, error);
      if (!isPassing(this.status)) return;
      await pause(this.#backoff.nextMs(error?.retryAfterMs), this.#over.signal);
    }
  }

  /** Tries until it succeeds; undefined if the mesh is refused or the pane is closed. */
  async #open(): Promise<Session | undefined> {
    const { positions, exact, faces } = this.mesh;
    const { signal } = this.#over;
    for (;;) {
      if (!isPassing(this.status)) this.#setStatus(say("opening", "Preparing…"));
      const frames = {
        encoding: this.encoding,
        lowestEncoding: "compressed",
        certify: true,
        maxFramesPerSecond: 60,
        signal,
        ...(this.shading && { shading: this.shading }),
      } as const;
      try {
        if (this.watched) return await joinSession(this.watched, frames);
        return await openSession(
          { vertices: exact ?? positions, faces },
          { ...frames, freeComponents: "follow", ...(this.weld && { weld: this.weld }) },
        );
      } catch (thrown) {
        if (signal.aborted) return undefined;
        const error = thrown as LpdeformError;
        this.#setStatus(this.#statusOf(error));
        if (!isPassing(this.status)) return undefined;
        await pause(this.#backoff.nextMs(error.retryAfterMs), signal);
        if (signal.aborted) return undefined;
      }
    }
  }

  /** Reads frames until the session ends. */
  async #readFrames(session: Session): Promise<{ hadFrames: boolean; error?: LpdeformError }> {
    let hadFrames = false;
    try {
      for await (const frame of session) {
        if (this.#over.signal.aborted) break;
        hadFrames = true;
        this.#pulse.heard();
        this.#waiting = frame;
        const taken = new Promise<void>((resolve) => (this.#taken = resolve));
        this.watcher.frame();
        await taken;
      }
    } catch (thrown) {
      return { hadFrames, error: thrown instanceof LpdeformError ? thrown : brokenHere(thrown) };
    }
    return { hadFrames };
  }

  #end(session: Session, error: LpdeformError): void {
    const atEnd = this.#failures < mostFailures ? statusAtEnd(error) : failingHere(error);
    this.#setStatus(this.watched && !atEnd.canTryAgain ? watchedStatus(error, atEnd) : atEnd);
    void session.close().catch(() => undefined);
    this.#session = undefined;
  }

  /** Only if the status says that it can. */
  tryAgain(): void {
    if (!this.status.canTryAgain) return;
    this.#failures = 0;
    this.#backoff.reset();
    this.#setStatus(say("opening", "Preparing…"));
    void this.#run();
  }

  #tell(time: number): void {
    const session = this.#session;
    const update = session && !this.watched && this.#news();
    if (!session || !update) return;
    const isInput = this.#told !== newSession;
    this.#told = this.document;
    this.#toldSearch = this.#search;
    try {
      this.#newest = session.update(update);
      this.#noteExponent(this.#newest);
      this.#sent.push({ seq: this.#newest, document: this.document });
      if (this.#sent.length > mostSent) this.#sent.shift();
      if (isInput) this.#inputs.push({ seq: this.#newest, time, sent: performance.now() });
    } catch (thrown) {
      this.watcher.problem(thrown as LpdeformError);
    }
  }

  /** What the server has not been told. */
  #news(): Update | undefined {
    const update = changes(this.#told, this.document, this.mesh, this.side);
    if (this.#search === this.#toldSearch) return update;
    return { ...update, settings: { ...update?.settings, solver: { search: this.#search } } };
  }

  #noteExponent(seq: number): void {
    const p = exponent(this.document, this.side);
    if (this.#exponents.at(-1)?.p === p) return;
    this.#exponents.push({ seq, p });
    if (this.#exponents.length > mostExponents) this.#exponents.shift();
  }

  #connection(): void {
    const connection = this.#session?.connection;
    if (connection === "connected") this.#pulse.start();
    else this.#pulse.stop();
    if (connection === "connected") this.#setStatus(live);
    if (connection === "reconnecting") {
      this.#setStatus(this.#statusOf(this.#session?.interruption ?? new LpdeformError("unavailable", "")));
    }
  }

  #statusOf(error: LpdeformError): Status {
    return this.watched ? watchedStatus(error) : statusOf(error);
  }

  #setStatus(status: Status): void {
    this.status = status;
    this.watcher.status(status);
  }
}

/** The page itself failed with a frame. */
function brokenHere(thrown: unknown): LpdeformError {
  return new LpdeformError("internal", String(thrown), { reason: "EXCEPTION" }, thrown);
}

/** Ends early if the signal aborts. */
function pause(milliseconds: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const done = () => {
      clearTimeout(timer);
      signal.removeEventListener("abort", done);
      resolve();
    };
    const timer = setTimeout(done, milliseconds);
    signal.addEventListener("abort", done);
    if (signal.aborted) done();
  });
}
