import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { fromBinary, type Message } from "@bufbuild/protobuf";
import type { GenMessage } from "@bufbuild/protobuf/codegenv2";
import { findTrailerError } from "@connectrpc/connect/protocol-grpc";
import { afterAll, beforeAll, expect, test } from "vitest";
import { loadDecompressor } from "../src/decode.js";
import type { LpdeformError } from "../src/errors.js";
import { Scalar } from "../src/gen/lpdeform/v1/data_pb.js";
import { Encoding as WireEncoding } from "../src/gen/lpdeform/v1/frame_pb.js";
import { type HandleUpdate } from "../src/gen/lpdeform/v1/handle_pb.js";
import {
  CreateSessionRequestSchema,
  DeformResponseSchema,
  FaultSchema,
  RestoreSessionResponseSchema,
  UndoUpdateResponseSchema,
  UpdateSchema,
} from "../src/gen/lpdeform/v1/service_pb.js";
import type { Encoding, Frame } from "../src/index.js";
import { openWith, restoreWith } from "../src/session.js";
import { FakeServer } from "./fake_server.js";
import { opened, problems } from "./harness.js";

// The golden recordings of tests/golden, which every client replays: the same numbers and errors from all.

const folder = fileURLToPath(new URL("../../../../tests/golden/", import.meta.url));
const read = (name: string) => readFileSync(folder + name, "utf8");
const bytes = (base64: string) => new Uint8Array(Buffer.from(base64, "base64"));
const message = <T extends Message>(schema: GenMessage<T>, base64: string): T => fromBinary(schema, bytes(base64));

interface Stream {
  name: string;
  update: string;
  responses: string[];
}
const frames = JSON.parse(read("frames.json")) as {
  create_request: string;
  streams: Stream[];
  undo: { response: string; result: string };
  snapshot: { file: string; restore_response: string };
};
const errors = JSON.parse(read("errors.json")) as { code: number; text: string; details: string; fault: string }[];
const expected = read("expected.txt").trimEnd().split("\n");

const numbers: string[] = [
  "",
  ...["cancelled", "unknown", "invalid_argument", "deadline_exceeded", "not_found", "already_exists"],
  ...["permission_denied", "resource_exhausted", "failed_precondition", "aborted", "out_of_range", "unimplemented"],
  ...["internal", "unavailable", "data_loss", "unauthenticated"],
];

const strip = {
  vertices: new Float32Array(Array.from({ length: 22 }, (_, i) => [Math.floor(i / 2), i % 2, 0]).flat()),
  faces: Array.from({ length: 60 }, (_, k) => 2 * Math.floor(k / 6) + [0, 2, 3, 0, 3, 1][k % 6]!),
};
const base = { vertices: [0, 1] };
const tip = { vertices: [20, 21], translation: [-4, 0, 3] as const };

const word = (value: number, digits: number) => value.toString(16).padStart(digits, "0");
const bits = (values: Float32Array) =>
  [...new Uint32Array(values.buffer, values.byteOffset, values.length)].map((value) => ` ${word(value, 8)}`).join("");

function linesOf(name: string, frame: Frame): string[] {
  const view = new DataView(new ArrayBuffer(8));
  view.setFloat64(0, frame.energy);
  const energy = word(view.getUint32(0), 8) + word(view.getUint32(4), 8);
  return [
    `${name}: result ${Number(frame.isFinal)}, ${frame.stopReason}, iteration ${frame.iteration}, energy ${energy}`,
    `${name} positions:${bits(frame.positions)}`,
    `${name} distortion:${bits(frame.distortion!)}`,
    `${name} normals:${bits(frame.normals!)}`,
  ];
}

const tell = (where: string, error: LpdeformError) =>
  `${where} ${numbers.indexOf(error.code)} ${error.reason} | ${error.element} | ${error.limit} | ${error.message}`;

/** Vertices, and where the handle goes: what a handle means, however it was packed. */
function meaning({ name, change }: HandleUpdate) {
  if (change.case !== "set") return { name, change: change.case };
  const source = change.value.vertices!.source;
  const vertices = source.case === "inline" ? [...new Uint32Array(source.value.slice().buffer)] : [];
  const kind = change.value.motion?.kind;
  const to = kind?.case === "rigid" ? kind.value.translation : undefined;
  return { name, vertices, translation: [to?.x ?? 0, to?.y ?? 0, to?.z ?? 0] };
}

const byName = (a: { name: string }, b: { name: string }) => a.name.localeCompare(b.name);

beforeAll(loadDecompressor);
afterAll(() => Promise.all(opened.splice(0).map((session) => session.close().catch(() => undefined))));

test.each(frames.streams)("the recorded frames in $name", async (stream) => {
  const server = new FakeServer();
  const encoding = stream.name as Encoding;
  const session = await openWith(server.rpc(), strip, { encoding, withNormals: true });
  opened.push(session);
  session.poll();
  await server.until(() => server.streams.length > 0);
  const asked = server.stream.request.streams[0]!.options!;
  expect(WireEncoding[asked.encoding]).toBe(encoding.startsWith("float") ? "RAW" : encoding.toUpperCase());
  expect(asked.scalar === Scalar.FLOAT64).toBe(encoding === "float64");
  session.setHandles({ base, tip: { vertices: tip.vertices, motion: { translation: tip.translation } } });
  await server.until(() => server.updates.length > 0);

  const sent = message(CreateSessionRequestSchema, frames.create_request).mesh!;
  const { vertexCount, faceCount } = server.creations[0]!.mesh!;
  expect([vertexCount, faceCount]).toEqual([sent.vertexCount, sent.faceCount]);
  const wanted = message(UpdateSchema, stream.update).handles.map(meaning).sort(byName);
  expect(server.updates[0]!.update!.handles.map(meaning).sort(byName)).toEqual(wanted);

  for (const text of stream.responses) {
    const response = message(DeformResponseSchema, text).message;
    if (response.case === "event")
      server.stream.queue.push({ stream: 0, event: { event: response.value.event as never } });
  }
  const frame = await session.settle();
  expect(frame.doubles?.positions.length).toBe(encoding === "float64" ? 66 : undefined);
  const { reason, text } = session.notice!;
  const said = [...linesOf(stream.name, frame), `${stream.name} notice: ${reason}, ${text}`];
  expect(said).toEqual(expected.filter((line) => line.startsWith(stream.name)));
});

test("the recorded undo, and what settling says before and after it that may not wait", async () => {
  const server = new FakeServer();
  const session = await openWith(server.rpc(), strip, { withNormals: true });
  opened.push(session);
  session.poll();
  await server.until(() => server.streams.length > 0);
  const recorded = frames.streams.find(({ name }) => name === "float32")!.responses;
  const say = (text: string) => {
    const response = message(DeformResponseSchema, text).message;
    if (response.case === "event")
      server.stream.queue.push({ stream: 0, event: { event: response.value.event as never } });
  };
  const settledAgain = () =>
    session.settle({ timeoutMs: 0 }).then(
      ({ stopReason, iteration }) => `settled again: ${stopReason}, iteration ${iteration}`,
      ({ reason }: LpdeformError) => `settled again: ${reason}`,
    );
  session.setHandles({ base, tip: { vertices: tip.vertices, motion: { translation: tip.translation } } });
  recorded.forEach(say);
  await session.settle();
  const said = [await settledAgain()];
  session.move("tip", { translation: [0, 0, 1] });
  said.push(await settledAgain());
  server.on.undo = () => message(UndoUpdateResponseSchema, frames.undo.response);
  const number = await session.undo();
  expect(server.undos[0]).toMatchObject({ inputSeq: BigInt(number), redo: false });
  expect(number).toBe(3);
  say(frames.undo.result);
  said.push(...linesOf("undo", await session.settle()), await settledAgain());
  expect(said).toEqual(expected.filter((line) => /^(undo|settled again)/.test(line)));
});

test("the recorded snapshot, in parts, and what is restored from it", async () => {
  const server = new FakeServer();
  const session = await openWith(server.rpc(), strip, {});
  opened.push(session);
  const file = Buffer.from(frames.snapshot.file, "base64");
  server.on.snapshot = async function* () {
    const sizeBytes = BigInt(file.length);
    for (let at = 0; at < file.length; at += 500)
      yield { offset: BigInt(at), sizeBytes, data: file.subarray(at, at + 500) };
  };
  const taken = await session.snapshot();
  const mesh = await session.mesh();
  expect([[...mesh.vertices], [...mesh.faces]]).toEqual([[...strip.vertices], strip.faces]);
  server.on.restore = () => message(RestoreSessionResponseSchema, frames.snapshot.restore_response);
  const restored = await restoreWith(server.rpc(), taken, {});
  opened.push(restored);
  expect(Buffer.from(server.restored[0]!.snapshot!.source.value as Uint8Array).equals(file)).toBe(true);
  expect([`snapshot: ${taken.length} bytes`, `restored: ${restored.name}`]).toEqual(
    expected.filter((line) => /^(snapshot|restored):/.test(line)),
  );
});

test("every recorded error of a call", async () => {
  const said: string[] = [];
  for (const { code, text, details } of errors) {
    const server = new FakeServer();
    const trailer = new Headers({
      "grpc-status": String(code),
      "grpc-message": encodeURIComponent(text),
      "grpc-status-details-bin": details,
    });
    server.on.create = () => {
      throw findTrailerError(trailer)!;
    };
    await openWith(server.rpc(500, 0), strip, {}).catch((error: LpdeformError) => said.push(tell("call", error)));
  }
  expect(said).toEqual(expected.filter((line) => line.startsWith("call ")));
});

test("every recorded fault of a stream", async () => {
  const server = new FakeServer();
  const session = await openWith(server.rpc(), strip, {});
  opened.push(session);
  session.poll();
  await server.until(() => server.streams.length > 0);
  server.stream.open(0, { vertexCount: strip.vertices.length / 3 });
  const all = problems(session, errors.length);
  for (const { fault } of errors) server.stream.send({ case: "fault", value: message(FaultSchema, fault) });
  expect((await all).map((error) => tell("fault", error))).toEqual(
    expected.filter((line) => line.startsWith("fault ")),
  );
});
