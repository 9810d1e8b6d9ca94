const beatMs = 100;
/** How long after the last answer the next question comes, and how long its answer may take. In beats. */
const restBeats = 4;
const patienceBeats = 9;

/**
 * Asks again and again whether the server answers. A server that was stopped, or whose proxy was, says nothing, and its stream
 * is silent anyway when nothing changes. Time is counted in beats of the page's own clock, so a page that is busy itself does not
 * take that for the server's silence. A hidden page does not ask.
 */
export class Pulse {
  isSilent = false;
  #timer: ReturnType<typeof setInterval> | undefined;
  #beats = 0;
  #isAsking = false;
  /** Counts starts and stops: an answer to an earlier run does not matter. */
  #run = 0;

  /**
   * `ask`: resolves with the answer. A server that rejects has answered, too, or is gone, which the stream tells. `changed`:
   * isSilent has changed while the pulse was running.
   */
  constructor(
    readonly ask: () => Promise<void>,
    readonly changed: () => void,
  ) {}

  start(): void {
    this.stop();
    this.#timer = setInterval(() => this.#beat(), beatMs);
  }

  /** Something else came from the server: there is no need to ask for a while. */
  heard(): void {
    this.#beats = 0;
    this.#set(false);
  }

  /** Until start(), it asks nothing and is not silent. */
  stop(): void {
    clearInterval(this.#timer);
    ++this.#run;
    this.#beats = 0;
    this.#isAsking = this.isSilent = false;
  }

  #beat(): void {
    ++this.#beats;
    if (this.#isAsking && this.#beats >= patienceBeats) this.#set(true);
    if (this.#isAsking || this.#beats < restBeats || globalThis.document?.hidden) return;
    this.#isAsking = true;
    this.#beats = 0;
    const run = this.#run;
    const done = () => {
      if (run !== this.#run) return;
      this.#isAsking = false;
      this.#beats = 0;
      this.#set(false);
    };
    this.ask().then(done, done);
  }

  #set(isSilent: boolean): void {
    if (this.isSilent === isSilent) return;
    this.isSilent = isSilent;
    this.changed();
  }
}
