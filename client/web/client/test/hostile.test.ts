import { clone, create, fromBinary, toBinary } from "@bufbuild/protobuf";
import { MeshoptEncoder } from "meshoptimizer/encoder";
import { beforeAll, expect, test } from "vitest";
import { FrameAssembly } from "../src/assembly.js";
import { loadDecompressor } from "../src/decode.js";
import { LpdeformError } from "../src/errors.js";
import { Scalar } from "../src/gen/lpdeform/v1/data_pb.js";
import { Encoding, type FramePart, FramePartSchema } from "../src/gen/lpdeform/v1/frame_pb.js";

// Frames that somebody damaged: each ends as a frame that fits, or as the error FRAME_PARTS, and never as anything else.

const vertices = 22;
const wrongCounts = [0, 1, 2, vertices - 1, vertices, vertices + 1, 2 ** 16, 2 ** 31 - 1, 2 ** 31, 2 ** 32 - 1];
const bytesNames = ["positions", "distortion", "normals"] as const;
const encodings = [Encoding.RAW, Encoding.QUANTIZED, Encoding.COMPRESSED];

beforeAll(async () => {
  await Promise.all([loadDecompressor(), MeshoptEncoder.ready]);
});

/** Whole numbers from 0 on and below `below`, the same in every run (xorshift). */
function chanceOf(seed: number): (below: number) => number {
  let state = seed;
  return (below) => {
    state ^= state << 13;
    state ^= state >>> 17;
    state ^= state << 5;
    return (state >>> 0) % below;
  };
}

function part(encoding: Encoding, isDouble: boolean, chance: (below: number) => number): FramePart {
  const random = (size: number) => Uint8Array.from({ length: size }, () => chance(256));
  const packed = (bytes: Uint8Array) =>
    encoding === Encoding.COMPRESSED ? MeshoptEncoder.encodeVertexBuffer(bytes, vertices, 8) : bytes;
  const isRaw = encoding === Encoding.RAW;
  const size = isDouble ? 8 : 4;
  return create(FramePartSchema, {
    frameSeq: 7n,
    vertexCount: vertices,
    last: true,
    header: {
      frameSeq: 7n,
      vertexCount: vertices,
      encoding,
      scalar: isDouble && isRaw ? Scalar.FLOAT64 : Scalar.FLOAT32,
      quantization: { origin: { x: 1, y: 2, z: 3 }, extent: { x: 1, y: 1, z: 0 }, distortionExtent: 2 },
    },
    positions: isRaw ? random(3 * size * vertices) : packed(random(8 * vertices)),
    distortion: isRaw ? random(size * vertices) : new Uint8Array(),
    normals: isRaw ? random(3 * size * vertices) : packed(random(8 * vertices)),
  });
}

/** A frame that came in one part, in two; of bytes that can be cut. */
function halves(whole: FramePart, at: number): FramePart[] {
  const [first, second] = [clone(FramePartSchema, whole), clone(FramePartSchema, whole)];
  delete second.header;
  Object.assign(first, { vertexCount: at, last: false });
  Object.assign(second, { vertexCount: vertices - at, firstVertex: at });
  for (const name of bytesNames) {
    const cut = (whole[name].length / vertices) * at;
    first[name] = whole[name].subarray(0, cut);
    second[name] = whole[name].subarray(cut);
  }
  return [first, second];
}

function damage(parts: FramePart[], chance: (below: number) => number): void {
  const index = chance(parts.length);
  const one = parts[index]!;
  const name = bytesNames[chance(3)]!;
  switch (chance(8)) {
    case 0:
      one[chance(2) === 0 ? "firstVertex" : "vertexCount"] = wrongCounts[chance(wrongCounts.length)]!;
      break;
    case 1:
      one.last = !one.last;
      break;
    case 2:
      delete one.header;
      break;
    case 3:
      if (one.header) one.header = { ...one.header, vertexCount: wrongCounts[chance(wrongCounts.length)]! };
      break;
    case 4:
      if (one.header) one.header = { ...one.header, encoding: [-1, 0, 1, 2, 3, 4, 99][chance(7)]!, scalar: chance(4) };
      break;
    case 5: {
      const before = one[name];
      const length = chance(2) === 0 ? chance(before.length + 1) : before.length + [1, 3, 8, 400][chance(4)]!;
      one[name] = new Uint8Array(length);
      one[name].set(before.subarray(0, length));
      break;
    }
    case 6:
      parts.splice(0, parts.length, ...Array.from({ length: 1 + chance(4) }, () => parts[chance(parts.length)]!));
      break;
    default: {
      // any bytes of the message, as long as that is still one
      const wire = toBinary(FramePartSchema, one);
      for (let k = chance(4); k > 0 && wire.length > 0; --k) wire[chance(wire.length)] = chance(256);
      try {
        parts[index] = fromBinary(FramePartSchema, wire);
      } catch {
        parts[index] = create(FramePartSchema);
      }
    }
  }
}

test("damaged frames are refused by reason, and whole ones taken", () => {
  const chance = chanceOf(2012);
  let taken = 0;
  let refused = 0;
  for (let turn = 0; turn < 20_000; ++turn) {
    const encoding = encodings[chance(3)]!;
    const isDouble = chance(2) === 0;
    const whole = part(encoding, isDouble, chance);
    const canBeCut = encoding !== Encoding.COMPRESSED && chance(2) === 0;
    const parts = canBeCut ? halves(whole, chance(vertices + 1)) : [whole];
    const isDamaged = turn % 10 !== 0;
    for (let k = isDamaged ? 1 + chance(3) : 0; k > 0; --k) damage(parts, chance);
    const assembly = new FrameAssembly(vertices, isDouble);
    let last;
    for (const one of parts) {
      try {
        last = assembly.add(one);
      } catch (error) {
        if (!(error instanceof LpdeformError)) throw error;
        expect(error.reason).toBe("FRAME_PARTS");
        expect(isDamaged).toBe(true);
        ++refused;
        continue;
      }
      if (!last) continue;
      ++taken;
      expect(last.positions.length).toBe(3 * vertices);
      expect([0, vertices]).toContain(last.distortion.length);
      expect([0, 3 * vertices]).toContain(last.normals.length);
    }
    if (!isDamaged) expect(last).toBeDefined();
  }
  expect(Math.min(taken, refused)).toBeGreaterThan(2000);
});

test("a frame with distortion or normals for a part of its vertices is refused", () => {
  for (const name of ["distortion", "normals"] as const) {
    for (const at of [0, 1]) {
      const parts = halves(part(Encoding.RAW, false, chanceOf(1)), 11);
      parts[at]![name] = new Uint8Array();
      const assembly = new FrameAssembly(vertices);
      assembly.add(parts[0]!);
      expect(() => assembly.add(parts[1]!)).toThrow(expect.objectContaining({ reason: "FRAME_PARTS" }));
    }
  }
});
