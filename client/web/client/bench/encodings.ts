// Sizes and decode times of frames by encoding: npm run bench. Measures, does not judge.
import { fromBinary, toBinary } from "@bufbuild/protobuf";
import { createClient } from "@connectrpc/connect";
import { createGrpcWebTransport } from "@connectrpc/connect-web";
import { FrameAssembly } from "../src/assembly.js";
import { loadDecompressor } from "../src/decode.js";
import { openSession } from "../src/index.js";
import {
  DeformService,
  type StreamSessionsResponse,
  StreamSessionsResponseSchema,
} from "../src/gen/lpdeform/v1/service_pb.js";
import { frameOptionsToWire } from "../src/towire.js";
import type { Encoding } from "../src/types.js";
import { Service } from "../test/support/service.js";
import { grid } from "../test/support/shapes.js";

const service = await Service.start();
await loadDecompressor();
const client = createClient(DeformService, createGrpcWebTransport({ baseUrl: service.url }));

/** The messages of the newest frame. */
async function messagesOf(session: string, encoding: Encoding): Promise<Uint8Array[]> {
  const options = { ...frameOptionsToWire({ encoding }) };
  const messages: StreamSessionsResponse[] = [];
  const abort = new AbortController();
  for await (const response of client.streamSessions({ streams: [{ session, options }] }, { signal: abort.signal })) {
    if (response.event?.event.case !== "frame") continue;
    messages.push(response);
    if (response.event.event.value.last) break;
  }
  abort.abort();
  return messages.map((message) => toBinary(StreamSessionsResponseSchema, message));
}

/** Milliseconds that `work` takes, the middle of many. */
function time(work: () => void): number {
  const all: number[] = [];
  for (let k = 0; k < 60; ++k) {
    const start = performance.now();
    work();
    all.push(performance.now() - start);
  }
  return all.sort((a, b) => a - b)[30]!;
}

console.log(
  "vertices  encoding    KiB  bytes/vertex  Mbit/s at 30  to attributes, ms  to positions and distortion, ms",
);
for (const side of [100, 316]) {
  const { mesh, handles } = grid(side);
  const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
  session.setHandles(handles);
  session.move("right", { axis: [0, 1, 0], angle: -1, center: [side, 0, 0], translation: [0, 0, side / 3] });
  await session.settle({ timeoutMs: 120_000 });
  const count = side * side;
  for (const encoding of ["float32", "quantized", "compressed"] satisfies Encoding[]) {
    const messages = await messagesOf(session.name, encoding);
    const bytes = messages.reduce((sum, message) => sum + message.byteLength, 0);
    const decode = () => {
      const assembly = new FrameAssembly(count);
      for (const message of messages) {
        const { event } = fromBinary(StreamSessionsResponseSchema, message);
        const frame = event?.event.case === "frame" ? assembly.add(event.event.value) : undefined;
        if (frame) return frame;
      }
      throw new Error("no frame");
    };
    const attributes = time(decode);
    const numbers = time(() => {
      const frame = decode();
      return frame.positions.length + frame.distortion.length;
    });
    const cells = [
      [String(count), 8],
      [encoding, 10],
      [(bytes / 1024).toFixed(0), 5],
      [(bytes / count).toFixed(2), 12],
      [((bytes * 8 * 30) / 1e6).toFixed(1), 12],
      [attributes.toFixed(3), 17],
      [numbers.toFixed(3), 30],
    ] as const;
    console.log(
      cells.map(([text, width]) => (text === encoding ? text.padEnd(width) : text.padStart(width))).join("  "),
    );
  }
  await session.close();
}
await service.stop();
process.exit();
