import type { MessageInitShape } from "@bufbuild/protobuf";
import type { Client } from "@connectrpc/connect";
import { fromCall, fromFault, LpdeformError, serverSilent } from "./errors.js";
import type { FrameOptionsSchema, FramePart } from "./gen/lpdeform/v1/frame_pb.js";
import {
  type AckFramesRequestSchema,
  type DeformService,
  type Fault,
  type GoAway,
  GoAwayReason,
  type Notice,
  type StreamEvent,
  type StreamOpened,
  type StreamSessionsRequestSchema,
} from "./gen/lpdeform/v1/service_pb.js";
import { inTaskOfItsOwn } from "./task.js";
import { isSessionLost } from "./verdict.js";

/** The calls to the server that streams need. */
export interface StreamCalls {
  readonly client: Pick<Client<typeof DeformService>, "streamSessions">;
  /** A stream that is silent for longer counts as dead. The server gives the interval when a stream opens. */
  longestSilenceMs: number;
  call(
    name: "ackFrames",
    request: MessageInitShape<typeof AckFramesRequestSchema>,
    signal: AbortSignal,
  ): Promise<unknown>;
}

/** Takes the messages of a lane. `opened` comes whenever the stream was opened again; `ended` comes once, as the last. */
export interface LaneSink {
  opened(opened: StreamOpened): void;
  part(part: FramePart): void;
  fault(fault: Fault): void;
  goAway(goAway: GoAway): void;
  notice(notice: Notice): void;
  ended(error?: LpdeformError): void;
  /** Whether nothing is to be sent, and no caller waits for a frame. */
  isQuiet(): boolean;
  /** The stream is asked for, for the first time or again; `opened` answers the newest request. */
  asked(): void;
  /** The stream pauses; `opened` comes when it continues. */
  resting(): void;
}

export type WireFrameOptions = MessageInitShape<typeof FrameOptionsSchema>;

const mostLanes = 16;

/** Bytes of positions in a part of a frame, from which on decoding several parts would keep a page busy. */
const largePart = 1 << 16;

function isLarge(event: StreamEvent | undefined): boolean {
  return event?.event.case === "frame" && event.event.value.positions.length > largePart;
}

/** How often a hidden page checks whether its stream may pause. */
const restIntervalMs = 10_000;

/**
 * The frames of all sessions of a page on one stream. Over plain HTTP a browser allows six connections to an origin for all its
 * tabs together, and a stream holds one of them for as long as it lives. So a hidden page that has nothing to send pauses its
 * stream until it is visible again or has an update: frames are of no use meanwhile, and a hidden page may not even be able to
 * take them. When a session is added or removed, the stream is opened again, with the newest frame of each session first.
 */
export class StreamHub {
  readonly #streams = new Set<SharedStream>();

  constructor(readonly calls: StreamCalls) {}

  subscribe(session: string, options: WireFrameOptions, sink: LaneSink): Lane {
    const withRoom = [...this.#streams].find((stream) => stream.lanes.size < mostLanes);
    const stream = withRoom ?? new SharedStream(this.calls, () => this.#streams.delete(stream));
    this.#streams.add(stream);
    const lane = new Lane(
      this.calls,
      session,
      options,
      sink,
      () => stream.remove(lane),
      () => stream.wake(),
    );
    stream.add(lane);
    return lane;
  }
}

/** One session's part of a stream. */
export class Lane {
  /** The id of the present stream; empty until it is open. */
  streamId = "";
  refusal: LpdeformError | undefined;
  readonly #abort = new AbortController();
  #ackDue = 0;
  #isAcking = false;

  constructor(
    readonly calls: StreamCalls,
    readonly session: string,
    readonly options: WireFrameOptions,
    readonly sink: LaneSink,
    readonly close: () => void,
    /** There is an update, or a caller waits for a frame: a paused stream must continue. */
    readonly wake: () => void,
  ) {}

  /**
   * Returns the credit of this frame of this stream and of all frames before it. The call begins in a task of its own, after the
   * session has received the frame: to begin a call keeps a page busy for a millisecond or two.
   */
  acknowledge(frameSeq: number, streamId: string): void {
    if (streamId !== this.streamId) return;
    this.#ackDue = Math.max(this.#ackDue, frameSeq);
    if (this.#isAcking) return;
    this.#isAcking = true;
    inTaskOfItsOwn(() => void this.#sendAcks());
  }

  /** There is no stream until another one is open. */
  forgetStream(): void {
    this.streamId = "";
    this.#ackDue = 0;
  }

  opened(opened: StreamOpened): void {
    this.forgetStream();
    this.streamId = opened.streamId;
    this.sink.opened(opened);
  }

  ended(error?: LpdeformError): void {
    this.#abort.abort();
    this.sink.ended(error);
  }

  /** A frame that came on it does not fit. */
  misfit(error: LpdeformError): void {
    if (this.#abort.signal.aborted) return;
    this.close();
    this.ended(error);
  }

  /** One call at a time, for the newest frame. */
  async #sendAcks(): Promise<void> {
    let sent = "";
    for (;;) {
      const { session, streamId } = this;
      const frameSeq = BigInt(this.#ackDue);
      if (this.#ackDue === 0 || `${streamId} ${frameSeq}` === sent || this.#abort.signal.aborted) break;
      sent = `${streamId} ${frameSeq}`;
      try {
        await this.calls.call("ackFrames", { session, streamId, frameSeq }, this.#abort.signal);
      } catch (thrown) {
        // Without credit the stream would stay silent. A stream that was replaced meanwhile needs none.
        if (streamId === this.streamId && !this.#abort.signal.aborted) {
          const error = thrown as LpdeformError;
          this.close();
          this.ended(isSessionLost(error) ? error : new LpdeformError("unavailable", error.message, {}, error));
        }
      }
    }
    this.#isAcking = false;
  }
}

/** A StreamSessions call, repeated when lanes are added. It counts as dead after three heartbeats of silence. */
class SharedStream {
  readonly lanes = new Set<Lane>();
  #call: AbortController | undefined;
  #isOpening = false;
  #silence: ReturnType<typeof setTimeout> | undefined;
  #isResting = false;
  #looking: ReturnType<typeof setInterval> | undefined;

  constructor(
    readonly calls: StreamCalls,
    readonly over: () => void,
  ) {
    globalThis.document?.addEventListener("visibilitychange", this.#lookWhileHidden);
    this.#lookWhileHidden();
  }

  wake(): void {
    if (!this.#isResting) return;
    this.#isResting = false;
    void this.#run();
  }

  readonly #lookWhileHidden = () => {
    clearInterval(this.#looking);
    if (globalThis.document?.hidden) this.#looking = setInterval(() => this.#rest(), restIntervalMs);
    else this.wake();
  };

  #rest(): void {
    const lanes = [...this.lanes];
    if (!this.#call || this.#isOpening || !lanes.every((lane) => lane.streamId && lane.sink.isQuiet())) return;
    this.#isResting = true;
    clearTimeout(this.#silence);
    this.#call.abort();
    this.#call = undefined;
    for (const lane of lanes) lane.sink.resting();
  }

  add(lane: Lane): void {
    this.lanes.add(lane);
    this.#reopen();
  }

  remove(lane: Lane): void {
    if (!this.lanes.delete(lane)) return;
    if (this.lanes.size === 0) this.#end();
    else this.#reopen();
  }

  #reopen(): void {
    if (this.#isOpening) return;
    this.#isOpening = true;
    queueMicrotask(() => {
      this.#isOpening = false;
      this.#isResting = false;
      if (this.lanes.size > 0) void this.#run();
    });
  }

  #end(): void {
    clearTimeout(this.#silence);
    clearInterval(this.#looking);
    globalThis.document?.removeEventListener("visibilitychange", this.#lookWhileHidden);
    this.#call?.abort();
    this.#call = undefined;
    this.over();
  }

  async #run(): Promise<void> {
    this.#call?.abort();
    const call = new AbortController();
    this.#call = call;
    const lanes = [...this.lanes];
    for (const lane of lanes) {
      lane.forgetStream();
      lane.sink.asked();
    }
    const request: MessageInitShape<typeof StreamSessionsRequestSchema> = {
      streams: lanes.map(({ session, options }) => ({ session, options })),
    };
    let error: LpdeformError | undefined;
    try {
      this.#heard(call);
      for await (const { stream, event } of this.calls.client.streamSessions(request, { signal: call.signal })) {
        if (this.#call !== call) return;
        const lane = lanes[stream];
        if (lane && event && this.lanes.has(lane)) this.#take(lane, event);
        if (this.#call === call) this.#heard(call);
        if (isLarge(event)) await new Promise<void>(inTaskOfItsOwn); // messages that have come together would be one task
      }
    } catch (thrown) {
      error = call.signal.reason instanceof LpdeformError ? call.signal.reason : fromCall(thrown);
    }
    if (this.#call !== call) return; // replaced or given up
    call.abort(); // if the failure was on this side, tells the server
    const left = [...this.lanes];
    this.lanes.clear();
    this.#end();
    for (const lane of left) lane.ended(error);
  }

  #take(lane: Lane, { event }: StreamEvent): void {
    switch (event.case) {
      case "opened":
        if (event.value.heartbeatIntervalMs > 0) this.calls.longestSilenceMs = 3 * event.value.heartbeatIntervalMs;
        this.#fit(lane, () => lane.opened(event.value));
        break;
      case "frame":
        this.#fit(lane, () => lane.sink.part(event.value));
        break;
      case "fault":
        if (lane.streamId) lane.sink.fault(event.value);
        else lane.refusal = fromFault(event.value);
        break;
      case "goAway":
        this.lanes.delete(lane);
        if (event.value.reason !== GoAwayReason.NOT_OPENED) lane.sink.goAway(event.value);
        lane.ended(lane.refusal);
        break;
      case "notice":
        lane.sink.notice(event.value);
        break;
    }
  }

  /** An error in a session's messages ends that session's lane; other lanes go on. */
  #fit(lane: Lane, take: () => void): void {
    try {
      take();
    } catch (misfit) {
      this.lanes.delete(lane);
      if (this.lanes.size === 0) this.#end();
      lane.ended(misfit as LpdeformError);
    }
  }

  #heard(call: AbortController): void {
    clearTimeout(this.#silence);
    this.#silence = setTimeout(() => call.abort(serverSilent()), this.calls.longestSilenceMs);
  }
}
