import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { Code, ConnectError, createRouterTransport, type ServiceImpl, type Transport } from "@connectrpc/connect";
import { Encoding, type FrameHeaderSchema } from "../src/gen/lpdeform/v1/frame_pb.js";
import {
  type AckFramesRequest,
  type CreateSessionRequest,
  DeformService,
  type GoAwayReason,
  type RestoreSessionRequest,
  type RestoreSessionResponseSchema,
  type SolveRequest,
  type StreamEventSchema,
  type StreamSessionsRequest,
  StreamSessionsResponseSchema,
  type TakeBetterShapeRequest,
  type TakeBetterShapeResponseSchema,
  type UndoUpdateRequest,
  type UndoUpdateResponseSchema,
  type UpdateHandlesRequest,
  type UploadPartRequest,
} from "../src/gen/lpdeform/v1/service_pb.js";
import { Rpc } from "../src/rpc.js";
import type { Mesh } from "../src/types.js";

/** A triangle. */
export const triangle: Mesh = { vertices: new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]), faces: [0, 1, 2] };

/** What a stream is told, and its end. */
class Queue<T> {
  #items: T[] = [];
  #end: ConnectError | "end" | undefined;
  #wake: (() => void) | undefined;

  push(item: T): void {
    this.#items.push(item);
    this.#wake?.();
  }

  finish(error?: ConnectError): void {
    this.#end ??= error ?? "end";
    this.#wake?.();
  }

  async *drain(signal: AbortSignal): AsyncGenerator<T> {
    signal.addEventListener("abort", () => this.finish(new ConnectError("aborted", Code.Canceled)));
    for (;;) {
      while (this.#items.length > 0) yield this.#items.shift()!;
      if (this.#end === "end") return;
      if (this.#end) throw this.#end;
      await new Promise<void>((resolve) => (this.#wake = resolve));
    }
  }
}

type Event = NonNullable<MessageInitShape<typeof StreamEventSchema>["event"]>;

/** A StreamSessions call as the test directs it. */
export class FakeStream {
  readonly queue = new Queue<{ stream: number; event: { event: Event } }>();
  isAborted = false;

  constructor(
    readonly request: StreamSessionsRequest,
    readonly id: string,
  ) {}

  send(event: Event, stream = 0): void {
    this.queue.push({ stream, event: { event } });
  }

  open(stream = 0, { epoch = 1n, inputSeq = 0n, heartbeatIntervalMs = 15_000, vertexCount = 3 } = {}): void {
    const streamId = `${this.id}.${stream}`;
    this.send({ case: "opened", value: { streamId, epoch, inputSeq, heartbeatIntervalMs, vertexCount } }, stream);
  }

  /** A frame of the triangle, all x at `x`. */
  frame(header: MessageInitShape<typeof FrameHeaderSchema>, { stream = 0, x = 0 } = {}): void {
    const positions = new Float32Array([x, 0, 0, x, 0, 0, x, 0, 0]);
    this.send(
      {
        case: "frame",
        value: {
          header: { vertexCount: 3, epoch: 1n, encoding: Encoding.RAW, ...header },
          frameSeq: header.frameSeq ?? 0n,
          vertexCount: 3,
          last: true,
          positions: new Uint8Array(positions.buffer),
          distortion: new Uint8Array(12),
        },
      },
      stream,
    );
  }

  goAway(reason: GoAwayReason, { stream = 0, reconnectAfterMs = 0, text = "gone" } = {}): void {
    this.send({ case: "goAway", value: { reason, text, reconnectAfterMs } }, stream);
  }
}

/** A server whose every word the test chooses. What it is asked is kept; what `on` has is done in place of a plain yes. */
export class FakeServer {
  readonly creations: CreateSessionRequest[] = [];
  readonly updates: UpdateHandlesRequest[] = [];
  readonly undos: UndoUpdateRequest[] = [];
  readonly betters: TakeBetterShapeRequest[] = [];
  readonly acks: AckFramesRequest[] = [];
  readonly solves: SolveRequest[] = [];
  readonly deleted: string[] = [];
  readonly streams: FakeStream[] = [];
  readonly uploads = new Map<string, Uint8Array>();
  readonly parts: UploadPartRequest[] = [];
  readonly restored: RestoreSessionRequest[] = [];
  undoSteps = 0;
  /** The newest that getSession() says it has. */
  inputSeq = 0n;
  /** What updates are answered with. */
  isKeeping = false;
  /** What it says of meshes in place of the truth. */
  vertexCount: number | undefined;
  on: {
    create?: (request: CreateSessionRequest, count: number) => void;
    update?: (request: UpdateHandlesRequest, count: number) => void | Promise<void>;
    undo?: (request: UndoUpdateRequest, count: number) => MessageInitShape<typeof UndoUpdateResponseSchema>;
    better?: (request: TakeBetterShapeRequest) => MessageInitShape<typeof TakeBetterShapeResponseSchema>;
    restore?: (request: RestoreSessionRequest) => MessageInitShape<typeof RestoreSessionResponseSchema>;
    snapshot?: ServiceImpl<typeof DeformService>["snapshotSession"];
    ack?: (request: AckFramesRequest) => void | Promise<void>;
    stream?: (stream: FakeStream, count: number) => void;
    /** `count`: of all parts that came. */
    part?: (request: UploadPartRequest, count: number) => void;
    solve?: ServiceImpl<typeof DeformService>["solve"];
  } = {};
  #changed = new Set<() => void>();

  rpc(callTimeoutMs = 5000, reconnectForMs = 10_000): Rpc {
    return new Rpc(this.#transport(), callTimeoutMs, reconnectForMs);
  }

  /** Resolves once `isSo`. */
  async until(isSo: () => boolean): Promise<void> {
    while (!isSo()) {
      await new Promise<void>((resolve) => {
        this.#changed.add(resolve);
      });
    }
  }

  get stream(): FakeStream {
    return this.streams.at(-1)!;
  }

  #note(): void {
    const waiting = this.#changed;
    this.#changed = new Set();
    for (const resolve of waiting) resolve();
  }

  #transport(): Transport {
    const report = {
      vertices: 3,
      faces: 1,
      edges: 3,
      components: 1,
      boundaryLoops: 1,
      defects: [],
      weldedVertices: 0,
      notices: [],
    };
    const session = (name: string, vertices = 3) => ({
      session: { name, epoch: 1n, mesh: { ...report, vertices: this.vertexCount ?? vertices } },
    });
    return createRouterTransport(({ service }) => {
      service(DeformService, {
        createSession: (request) => {
          this.creations.push(request);
          this.#note();
          this.on.create?.(request, this.creations.length);
          const vertices = request.mesh?.vertexCount ?? 0;
          return { ...session(`sessions/${this.creations.length}`, vertices), writerToken: "token" };
        },
        restoreSession: (request) => {
          this.restored.push(request);
          this.#note();
          const restored = { ...session(`sessions/restored${this.restored.length}`), writerToken: "token" };
          return this.on.restore?.(request) ?? restored;
        },
        snapshotSession: (request, context) => this.on.snapshot!(request, context),
        undoUpdate: (request) => {
          this.undos.push(request);
          this.#note();
          return this.on.undo?.(request, this.undos.length) ?? { result: { inputSeq: request.inputSeq } };
        },
        takeBetterShape: (request) => {
          this.betters.push(request);
          this.#note();
          return this.on.better?.(request) ?? {};
        },
        getSession: ({ session: name }) => ({
          session: { ...session(name).session, undoSteps: this.undoSteps, inputSeq: this.inputSeq },
        }),
        acquireWriter: () => ({ writerToken: "another", epoch: 7n, inputSeq: 40n }),
        deleteSession: ({ session: name }) => {
          this.deleted.push(name);
          return {};
        },
        updateHandles: async (request) => {
          this.updates.push(request);
          this.#note();
          await this.on.update?.(request, this.updates.length);
          return { result: { inputSeq: request.update?.inputSeq ?? 0n, kept: this.isKeeping } };
        },
        ackFrames: async (request) => {
          this.acks.push(request);
          this.#note();
          await this.on.ack?.(request);
          return {};
        },
        createUpload: ({ sizeBytes }) => {
          const upload = `uploads/${this.uploads.size}`;
          this.uploads.set(upload, new Uint8Array(Number(sizeBytes)));
          return { upload, maxPartBytes: 1 << 20 };
        },
        uploadPart: (request) => {
          const { upload, offset, data } = request;
          this.parts.push(request);
          this.#note();
          this.on.part?.(request, this.parts.length);
          const whole = this.uploads.get(upload)!;
          whole.set(data, Number(offset));
          return { finished: Number(offset) + data.length === whole.length };
        },
        deleteUpload: () => ({}),
        streamSessions: (request, context) => {
          const stream = new FakeStream(request, `stream${this.streams.length + 1}`);
          this.streams.push(stream);
          this.#note();
          context.signal.addEventListener("abort", () => {
            stream.isAborted = true;
            this.#note();
          });
          this.on.stream?.(stream, this.streams.length);
          return this.#responses(stream, context.signal);
        },
        solve: (request, context) => {
          this.solves.push(request);
          this.#note();
          return this.on.solve!(request, context);
        },
      });
    });
  }

  async *#responses(stream: FakeStream, signal: AbortSignal) {
    for await (const response of stream.queue.drain(signal)) yield create(StreamSessionsResponseSchema, response);
  }
}
