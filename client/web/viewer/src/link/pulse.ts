import type { LpdeformError } from "lpdeform-client";

const beatMs = 100;
/** How long after the last answer the next question comes, and how long its answer may take. */
const restMs = 400;
const patienceMs = 900;
/** A beat that comes later than this was delayed by the page itself: the rest of the delay does not count. */
const longestBeatMs = 250;

/**
 * Asks again and again whether the server answers. A server that was stopped, or whose proxy was, says nothing, and its stream
 * is silent anyway when nothing changes. Time is counted in beats of the page's own clock, so a page that was busy for long itself
 * does not take that for the server's silence. A hidden page does not ask.
 */
export class Pulse {
  isSilent = false;
  #timer: ReturnType<typeof setInterval> | undefined;
  #lastBeat = 0;
  /** In milliseconds: since the question, or since the last answer. */
  #waited = 0;
  #isAsking = false;
  /** Counts starts and stops: an answer to an earlier run does not matter. */
  #run = 0;

  /**
   * `ask`: resolves with the answer, or rejects with an LpdeformError. A server that refuses has answered, too. `changed`: isSilent
   * has changed while the pulse was running.
   */
  constructor(
    readonly ask: () => Promise<void>,
    readonly changed: () => void,
  ) {}

  start(): void {
    this.stop();
    this.#lastBeat = performance.now();
    this.#timer = setInterval(() => this.#beat(), beatMs);
  }

  /** Something else came from the server: there is no need to ask for a while. */
  heard(): void {
    this.#waited = 0;
    this.#set(false);
  }

  /** Until start(), it asks nothing and is not silent. */
  stop(): void {
    clearInterval(this.#timer);
    ++this.#run;
    this.#waited = 0;
    this.#isAsking = this.isSilent = false;
  }

  #beat(): void {
    const now = performance.now();
    this.#waited += Math.min(now - this.#lastBeat, longestBeatMs);
    this.#lastBeat = now;
    if (this.#isAsking && this.#waited >= patienceMs) this.#set(true);
    if (this.#isAsking || this.#waited < restMs || globalThis.document?.hidden) return;
    this.#isAsking = true;
    this.#waited = 0;
    const run = this.#run;
    const done = (isSilent: boolean) => {
      if (run !== this.#run) return;
      this.#isAsking = false;
      this.#waited = 0;
      this.#set(isSilent);
    };
    this.ask().then(
      () => done(false),
      (error: LpdeformError) => done(isUnanswered(error)),
    );
  }

  #set(isSilent: boolean): void {
    if (this.isSilent === isSilent) return;
    this.isSilent = isSilent;
    this.changed();
  }
}

/** Whether a proxy speaks for a server that it does not reach: servers give a reason. */
function isUnanswered({ code, reason }: LpdeformError): boolean {
  return code === "unavailable" && reason === "";
}
