import { joinSession, LpdeformError, openSession, type Session } from "../src/index.js";
import { grid } from "../test/support/shapes.js";
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
  #driver: Session; // the one that moves: the owner, or who has taken over from it
  #isReconnecting = false;
  #isOver = false;
  readonly #reading: Promise<void>[] = [];
  readonly #slow: Session[] = [];
  readonly #over: Promise<void>;
  #end = () => {};

  private constructor(
    readonly url: string,
    readonly owner: Session, // made the session, and deletes it
    readonly side: number,
  ) {
    this.vertices = side * side;
    this.#driver = owner;
    this.#over = new Promise((end) => (this.#end = end));
    this.#watch(owner);
  }

  #watch(session: Session): void {
    // A stream that another replaced reports how it ended.
    session.on("problem", (error) => {
      if (session === this.#driver && !this.#isReconnecting) this.#note(error);
    });
    session.on("connection", (state) => {
      if (state === "reconnecting" && session === this.#driver) ++this.tally.reconnects;
    });
  }

  /** Opens the session and waits for its first result. */
  static async open(url: string, vertices: number, p: number): Promise<Lane> {
    const begin = performance.now();
    const side = Math.max(2, Math.round(Math.sqrt(vertices)));
    const { mesh, handles } = grid(side);
    const lane = new Lane(url, await openSession(mesh, { url, settings: { p } }), side);
    lane.owner.setHandles({ base: handles.left, tip: { ...handles.right, motion: lane.#lifted(1) } });
    await lane.owner.settle();
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
      this.#pending.push({ inputSeq: this.#driver.move("tip", this.#lifted(++this.#moves + 1)), due });
    } catch (error) {
      if (this.#isReconnecting) {
        this.#pending.push({ inputSeq: Infinity, due });
        return;
      }
      this.tally.unanswered += 1;
      this.#note(error);
    }
  }

  /** Takes frames until the lane is over. */
  start(): void {
    this.#reading.push(this.#read(this.#driver));
  }

  async #read(session: Session): Promise<void> {
    try {
      for await (const frame of session) {
        const now = performance.now();
        this.tally.frames += 1;
        this.tally.skipped += frame.skippedInputs;
        if (frame.inputSeq < session.newestInput) this.tally.stale += 1;
        this.tally.payloadBytes += frame.positions.byteLength + (frame.distortion?.byteLength ?? 0);
        while (this.#pending[0] && this.#pending[0].inputSeq <= frame.inputSeq) {
          this.tally.latency.record(1000 * (now - this.#pending.shift()!.due));
        }
      }
    } catch (error) {
      if (session === this.#driver && !this.#isReconnecting) this.#note(error);
    }
  }

  /** Looks on beside the writer, a frame every `pauseMs`. */
  async addSlowReader(pauseMs: number): Promise<void> {
    const reader = await joinSession(this.owner.name, { url: this.url, role: "reader", credit: 1 });
    reader.on("problem", (error) => this.#note(error));
    this.#slow.push(reader);
    this.#reading.push(this.#readSlowly(reader, pauseMs));
  }

  async #readSlowly(reader: Session, pauseMs: number): Promise<void> {
    try {
      for await (const frame of reader) {
        void frame;
        await Promise.race([this.#over, new Promise((next) => setTimeout(next, pauseMs))]);
        if (this.#isOver) return;
      }
    } catch (error) {
      if (!this.#isOver) this.#note(error);
    }
  }

  /** Drops the connection and takes the session over on a new one. */
  async reconnect(): Promise<void> {
    if (this.#isOver || this.#isReconnecting) return;
    this.#isReconnecting = true;
    const before = this.#driver;
    try {
      const joined = await joinSession(this.owner.name, { url: this.url, role: "writer" });
      this.#watch(joined);
      this.#driver = joined;
      ++this.tally.reconnects;
      // Updates that the previous connection left unanswered are answered with the first update of this one.
      const first = joined.move("tip", this.#lifted(this.#moves + 1));
      for (const one of this.#pending) one.inputSeq = Math.min(one.inputSeq, first);
      this.#reading.push(this.#read(joined));
      if (before !== this.owner) await before.close();
    } catch (error) {
      this.#note(error);
    } finally {
      this.#isReconnecting = false;
    }
  }

  get isAnswered(): boolean {
    return this.#pending.length === 0;
  }

  /** Deletes the session; what is unanswered now stays so. */
  async finish(): Promise<Tally> {
    this.tally.unanswered += this.#pending.length;
    this.#isOver = true;
    this.#end();
    for (const session of [...this.#slow, this.#driver]) if (session !== this.owner) await session.close();
    await this.owner.close();
    await Promise.all(this.#reading);
    return this.tally;
  }
}
