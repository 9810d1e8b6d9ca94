import { LpdeformError, openSession, type Session } from "../src/index.js";
import { grid } from "../test/real/shapes.js";
import { Histogram } from "./histogram.js";

const movesACircle = 64;

/** What came of a lane, or of several together. As LoadTally of client/cli/load/lane.h. */
export class Tally {
  readonly latency = new Histogram();
  readonly setup = new Histogram();
  due = 0;
  unanswered = 0;
  frames = 0;
  skipped = 0;
  stale = 0;
  reconnects = 0;
  payloadBytes = 0;
  readonly errors = new Map<string, number>();

  add(other: Tally): void {
    this.latency.add(other.latency);
    this.setup.add(other.setup);
    this.due += other.due;
    this.unanswered += other.unanswered;
    this.frames += other.frames;
    this.skipped += other.skipped;
    this.stale += other.stale;
    this.reconnects += other.reconnects;
    this.payloadBytes += other.payloadBytes;
    for (const [reason, count] of other.errors) this.errors.set(reason, (this.errors.get(reason) ?? 0) + count);
  }
}

/** One session under load: a sheet whose one edge is held and the other moved with every update. */
export class Lane {
  readonly tally = new Tally();
  readonly vertices: number;
  #pending: { inputSeq: number; due: number }[] = [];
  #moves = 0;

  private constructor(
    readonly session: Session,
    readonly side: number,
  ) {
    this.vertices = side * side;
    session.on("problem", (error) => this.#note(error));
    session.on("connection", (state) => {
      if (state === "reconnecting") ++this.tally.reconnects;
    });
  }

  /** Opens the session and waits for its first result. */
  static async open(url: string, vertices: number, p: number): Promise<Lane> {
    const begin = performance.now();
    const side = Math.max(2, Math.round(Math.sqrt(vertices)));
    const { mesh, handles } = grid(side);
    const lane = new Lane(await openSession(mesh, { url, settings: { p } }), side);
    lane.session.setHandles({ base: handles.left, tip: { ...handles.right, motion: lane.#lifted(1) } });
    await lane.session.settle();
    lane.tally.setup.record(1000 * (performance.now() - begin));
    return lane;
  }

  #lifted(moves: number): { translation: [number, number, number] } {
    return { translation: [0, 0, 0.3 * this.side * Math.sin((2 * Math.PI * moves) / movesACircle)] };
  }

  #note(error: unknown): void {
    const reason = error instanceof LpdeformError ? error.reason : String(error);
    this.tally.errors.set(reason, (this.tally.errors.get(reason) ?? 0) + 1);
  }

  /** Sends the update that was due at `due`; does not wait. */
  move(due: number): void {
    this.tally.due += 1;
    try {
      this.#pending.push({ inputSeq: this.session.move("tip", this.#lifted(++this.#moves + 1)), due });
    } catch (error) {
      this.tally.unanswered += 1;
      this.#note(error);
    }
  }

  /** Takes frames until the session is closed. */
  async read(): Promise<void> {
    try {
      for await (const frame of this.session) {
        const now = performance.now();
        this.tally.frames += 1;
        this.tally.skipped += frame.skippedInputs;
        if (frame.inputSeq < this.session.newestInput) this.tally.stale += 1;
        this.tally.payloadBytes += frame.positions.byteLength + (frame.distortion?.byteLength ?? 0);
        while (this.#pending[0] && this.#pending[0].inputSeq <= frame.inputSeq) {
          this.tally.latency.record(1000 * (now - this.#pending.shift()!.due));
        }
      }
    } catch (error) {
      this.#note(error);
    }
  }

  get isAnswered(): boolean {
    return this.#pending.length === 0;
  }

  /** Deletes the session; what is unanswered now stays so. */
  async finish(): Promise<Tally> {
    this.tally.unanswered += this.#pending.length;
    await this.session.close();
    return this.tally;
  }
}
