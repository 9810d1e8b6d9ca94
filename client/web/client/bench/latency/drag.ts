import { type Encoding, type Frame, openSession } from "../../src/index.js";
import { inTaskOfItsOwn } from "../../src/task.js";
import { bar } from "./bar.js";

export interface Drag {
  /** Where the page does not come from. */
  url?: string;
  vertices: number;
  p: number;
  movesPerSecond: number;
  /** 0: without limit. */
  framesPerSecond: number;
  seconds: number;
  encoding: Encoding;
}

/** Milliseconds from a move to the callback that has the frame which answers it; the parts are means and add up to `mean`. */
export interface DragFacts {
  vertices: number;
  inputs: number;
  p50: number;
  p99: number;
  mean: number;
  /** Until the request is given to fetch(). */
  request: number;
  /** From there until the first bytes of the frame are there: both ways, proxy, server, solver. */
  away: number;
  /** From there until its last bytes are. */
  arriving: number;
  /** From there until the callback: messages, decoding. */
  decoding: number;
}

/** Notes when requests go out, and when the bytes of the stream of frames come in. */
class Wire {
  /** Of the last call of UpdateHandles. */
  sentAt = 0;
  #first: number | undefined;
  #last = 0;

  readonly fetch: typeof fetch = async (input, init) => {
    const url = String(input);
    if (url.endsWith("/UpdateHandles")) this.sentAt = performance.now();
    const response = await globalThis.fetch(input, init);
    if (url.endsWith("/StreamSessions") && response.body) this.#watch(response.body);
    return response;
  };

  /** When the first and the last bytes since the last call came. */
  takeArrival(): { first: number; last: number } {
    const first = this.#first ?? this.#last;
    this.#first = undefined;
    return { first, last: this.#last };
  }

  #watch(body: ReadableStream<Uint8Array>): void {
    const getReader = body.getReader.bind(body) as () => ReadableStreamDefaultReader<Uint8Array>;
    body.getReader = (() => {
      const reader = getReader();
      const read = reader.read.bind(reader);
      reader.read = async () => {
        const chunk = await read();
        this.#last = performance.now();
        this.#first ??= this.#last;
        return chunk;
      };
      return reader;
    }) as typeof body.getReader;
  }
}

interface Move {
  seq: number;
  at: number;
  sentAt: number;
}

/** Drags as tests/bench/live/native_drag.cc does. */
export async function drag(options: Drag): Promise<DragFacts> {
  const { mesh, handles } = bar(options.vertices);
  const wire = new Wire();
  const session = await openSession(mesh, {
    ...(options.url !== undefined && { url: options.url }),
    fetch: wire.fetch,
    encoding: options.encoding,
    lowestEncoding: options.encoding,
    maxFramesPerSecond: options.framesPerSecond,
    settings: { p: options.p },
  });
  session.setHandles(handles);
  await session.settle();
  const waiting: Move[] = [];
  const latencies: number[] = [];
  const parts = { request: 0, away: 0, arriving: 0, decoding: 0 };
  const take = ({ inputSeq }: Frame) => {
    const now = performance.now();
    const { first, last } = wire.takeArrival();
    while (waiting.length > 0 && waiting[0]!.seq <= inputSeq) {
      const { at, sentAt } = waiting.shift()!;
      latencies.push(now - at);
      parts.request += sentAt - at;
      parts.away += first - sentAt;
      parts.arriving += last - first;
      parts.decoding += now - last;
    }
  };
  wire.takeArrival();
  let lastSeq = Infinity;
  const reading = (async () => {
    for await (const frame of session) {
      take(frame);
      if (frame.isFinal && frame.inputSeq >= lastSeq) return;
    }
  })();
  const begin = performance.now();
  const moves = options.seconds * options.movesPerSecond;
  for (let k = 1; k <= moves; ++k) {
    const now = (performance.now() - begin) / 1000;
    const at = performance.now();
    const translation = [Math.sin(now / 0.9), 0, -0.36 * (1 - Math.cos(now / 0.7))] as const;
    const move: Move = { seq: session.move("top", { translation: [...translation] }), at, sentAt: at };
    waiting.push(move);
    inTaskOfItsOwn(() => (move.sentAt = Math.max(move.at, wire.sentAt))); // fetch() was called by then
    await new Promise((next) => setTimeout(next, begin + (1000 * k) / options.movesPerSecond - performance.now()));
  }
  lastSeq = session.move("top", { translation: [0, 0, 0] });
  await reading;
  await session.close();
  latencies.sort((a, b) => a - b);
  const of = (sum: number) => sum / latencies.length;
  const at = (share: number) => latencies[Math.floor(share * (latencies.length - 1))] ?? NaN;
  return {
    vertices: mesh.vertices.length / 3,
    inputs: latencies.length,
    p50: at(0.5),
    p99: at(0.99),
    mean: of(latencies.reduce((sum, one) => sum + one, 0)),
    request: of(parts.request),
    away: of(parts.away),
    arriving: of(parts.arriving),
    decoding: of(parts.decoding),
  };
}
