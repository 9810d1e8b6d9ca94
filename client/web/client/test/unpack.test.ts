import { create } from "@bufbuild/protobuf";
import { MeshoptEncoder } from "meshoptimizer/encoder";
import { afterEach, beforeAll, expect, test, vi } from "vitest";
import { FrameAssembly } from "../src/assembly.js";
import { loadDecompressor } from "../src/decode.js";
import { Encoding, FramePartSchema } from "../src/gen/lpdeform/v1/frame_pb.js";
import { unpack, Unpacker, unpackerFor, type UnpackRequest } from "../src/unpack.js";

const count = 6;
const vertices = Uint16Array.from({ length: 4 * count }, (_, k) => 1000 * k);
const normals = Int16Array.from({ length: 4 * count }, (_, k) => 500 * k - 4000);
const bytesOf = (array: ArrayBufferView) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

beforeAll(async () => {
  await Promise.all([loadDecompressor(), MeshoptEncoder.ready]);
});

afterEach(() => void vi.unstubAllGlobals());

/** The frame as it is assembled of two parts. */
function assembled(isPacked: boolean, encoding = Encoding.QUANTIZED) {
  const assembly = new FrameAssembly(count, false, isPacked);
  const quantization = { origin: { x: -1, y: 2, z: 0 }, extent: { x: 3, y: 1, z: 0.5 }, distortionExtent: 8 };
  const compressed = (bytes: Uint8Array, n: number) => MeshoptEncoder.encodeVertexBufferLevel(bytes, n, 8, 2, 0);
  const send = (first: number, vertexCount: number, last: boolean) => {
    const blocks = [vertices, normals].map((all) => bytesOf(all).slice(8 * first, 8 * (first + vertexCount)));
    const [positions, turned] =
      encoding === Encoding.COMPRESSED ? blocks.map((block) => compressed(block, vertexCount)) : blocks;
    const header = first === 0 ? { header: { frameSeq: 1n, vertexCount: count, encoding, quantization } } : {};
    const part = {
      ...header,
      frameSeq: 1n,
      firstVertex: first,
      vertexCount,
      last,
      positions: positions!,
      normals: turned!,
    };
    return assembly.add(create(FramePartSchema, part));
  };
  send(0, 4, false);
  return send(4, 2, true)!;
}

test.each([Encoding.QUANTIZED, Encoding.COMPRESSED])(
  "a frame that is unpacked later is the same, encoding %i",
  (encoding) => {
    const frame = assembled(true, encoding);
    frame.take(unpack(frame.packed!));
    const here = assembled(false, encoding);
    expect(frame.packed).toBeUndefined();
    for (const what of ["positions", "distortion", "normals", "quantized", "wireBytes"] as const) {
      expect(frame[what]).toEqual(here[what]);
    }
    expect(frame.positions[0]).toBe(-1);
  },
);

test("a part of the wrong size does not wait for the worker", () => {
  const assembly = new FrameAssembly(2, false, true);
  const header = { frameSeq: 1n, vertexCount: 2, encoding: Encoding.QUANTIZED };
  const part = { header, frameSeq: 1n, vertexCount: 2, last: true, positions: new Uint8Array(15) };
  expect(() => assembly.add(create(FramePartSchema, part))).toThrow(expect.objectContaining({ reason: "FRAME_PARTS" }));
});

/** A worker whose script cannot be loaded, as when a page's policy forbids it. */
class BrokenWorker {
  static count = 0;
  onerror: (() => void) | undefined;
  constructor() {
    ++BrokenWorker.count;
    setTimeout(() => this.onerror?.(), 5);
  }
  postMessage(_: UnpackRequest): void {}
  terminate(): void {}
}

test("a page whose worker cannot be loaded, or made, unpacks by itself", async () => {
  const { packed } = assembled(true, Encoding.COMPRESSED);
  vi.stubGlobal("Worker", BrokenWorker);
  const unpacker = new Unpacker();
  const [one, other] = await Promise.all([unpacker.unpack(packed!), unpacker.unpack(packed!)]);
  expect(one.quantized.vertices).toEqual(vertices);
  expect(other).toEqual(one);
  expect(await unpacker.unpack(packed!)).toEqual(one);
  vi.stubGlobal("Worker", () => {
    throw new DOMException("not here", "SecurityError");
  });
  expect(await new Unpacker().unpack(packed!)).toEqual(one);
  expect(BrokenWorker.count).toBe(1);
});

test("a block that cannot be read is FRAME_PARTS", async () => {
  const { packed } = assembled(true, Encoding.COMPRESSED);
  packed!.parts[1]!.vertices = Uint8Array.of(1, 2, 3);
  await expect(new Unpacker().unpack(packed!)).rejects.toMatchObject({ code: "data_loss", reason: "FRAME_PARTS" });
});

test("only frames of many vertices are given to a worker, and none where there are no workers", () => {
  expect(unpackerFor(1_000_000)).toBeUndefined();
  vi.stubGlobal("Worker", BrokenWorker);
  expect(unpackerFor(1000)).toBeUndefined();
  expect(unpackerFor(1_000_000)).toBe(unpackerFor(30_000));
});
