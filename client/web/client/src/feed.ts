import { fromCall, LpdeformError } from "./errors.js";
import type { FramePart } from "./gen/lpdeform/v1/frame_pb.js";
import type { Fault, GoAway, StreamOpened } from "./gen/lpdeform/v1/service_pb.js";
import type { Rpc } from "./rpc.js";
import type { FrameOptions } from "./types.js";

/** Takes what comes on a feed; `ended` comes once, and last. */
export interface FeedSink {
  opened(opened: StreamOpened): void;
  part(part: FramePart): void;
  fault(fault: Fault): void;
  goAway(goAway: GoAway): void;
  ended(error?: LpdeformError): void;
}

/** The stream of a session's frames, from subscribing until it ends. It is dead after three heartbeats of silence. */
export class FrameFeed {
  readonly #abort = new AbortController();
  #streamId = "";
  #ackDue = 0;
  #isAcking = false;
  #silence: ReturnType<typeof setTimeout> | undefined;
  #longestSilenceMs = 45_000;

  constructor(
    readonly rpc: Rpc,
    readonly session: string,
    readonly options: FrameOptions,
    readonly sink: FeedSink,
  ) {
    void this.#run();
  }

  /** This frame and all before it have been taken; gives their credit back. */
  acknowledge(frameSeq: number): void {
    this.#ackDue = Math.max(this.#ackDue, frameSeq);
    if (!this.#isAcking) void this.#sendAcks();
  }

  close(): void {
    this.#abort.abort();
  }

  async #run(): Promise<void> {
    let error: LpdeformError | undefined;
    try {
      this.#heard();
      const { credit = 0, withoutDistortion = false, withNormals = false, maxFramesPerSecond = 0 } = this.options;
      const options = { credit, withoutDistortion, withNormals, maxFramesPerSecond };
      const request = { session: this.session, options };
      for await (const { event } of this.rpc.client.streamFrames(request, { signal: this.#abort.signal })) {
        this.#heard();
        switch (event?.event.case) {
          case "opened":
            this.#streamId = event.event.value.streamId;
            if (event.event.value.heartbeatIntervalMs > 0) {
              this.#longestSilenceMs = 3 * event.event.value.heartbeatIntervalMs;
            }
            this.sink.opened(event.event.value);
            break;
          case "frame":
            this.sink.part(event.event.value);
            break;
          case "fault":
            this.sink.fault(event.event.value);
            break;
          case "goAway":
            this.sink.goAway(event.event.value);
            break;
        }
      }
    } catch (thrown) {
      error = this.#abort.signal.reason instanceof LpdeformError ? this.#abort.signal.reason : fromCall(thrown);
    }
    clearTimeout(this.#silence);
    this.#abort.abort();
    this.sink.ended(error);
  }

  #heard(): void {
    clearTimeout(this.#silence);
    this.#silence = setTimeout(() => {
      this.#abort.abort(new LpdeformError("unavailable", "The server has fallen silent.", { reason: "SILENCE" }));
    }, this.#longestSilenceMs);
  }

  async #sendAcks(): Promise<void> {
    this.#isAcking = true;
    let sent = 0;
    while (this.#ackDue > sent && !this.#abort.signal.aborted) {
      sent = this.#ackDue;
      const request = { session: this.session, streamId: this.#streamId, frameSeq: BigInt(sent) };
      try {
        await this.rpc.call("ackFrames", request, this.#abort.signal);
      } catch (error) {
        this.#abort.abort(error); // without credit it would stay silent
      }
    }
    this.#isAcking = false;
  }
}
