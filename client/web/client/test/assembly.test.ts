import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { MeshoptEncoder } from "meshoptimizer/encoder";
import { beforeAll, describe, expect, test } from "vitest";
import { FrameAssembly } from "../src/assembly.js";
import { loadDecompressor } from "../src/decode.js";
import { Scalar } from "../src/gen/lpdeform/v1/data_pb.js";
import { Encoding, type FrameHeaderSchema, type FramePart, FramePartSchema } from "../src/gen/lpdeform/v1/frame_pb.js";

const bytesOf = (array: ArrayBufferView) => new Uint8Array(array.buffer, array.byteOffset, array.byteLength);

type PartInit = Exclude<MessageInitShape<typeof FramePartSchema>, FramePart>;

function part(init: PartInit): FramePart {
  return create(FramePartSchema, { frameSeq: 7n, vertexCount: 2, last: true, ...init });
}

function header(init: MessageInitShape<typeof FrameHeaderSchema> = {}): MessageInitShape<typeof FrameHeaderSchema> {
  return { frameSeq: 7n, vertexCount: 2, scalar: Scalar.FLOAT32, encoding: Encoding.RAW, ...init };
}

const positions = new Float32Array([1, 2, 3, 4, 5, 6]);
const quantization = { origin: { x: -1, y: 0, z: 0 }, extent: { x: 3, y: 0, z: 0.5 }, distortionExtent: 8 };
const quantized = new Uint16Array([0, 0, 0, 0, 65535, 65535, 65535, 65535]);
const quantizedNormals = new Int16Array([0, 0, 32767, 0, -32767, 0, 0, 0]);

beforeAll(async () => {
  await Promise.all([loadDecompressor(), MeshoptEncoder.ready]);
});

describe("raw frames", () => {
  test("of one part are views of the message", () => {
    const message = new Uint8Array(64);
    message.set(bytesOf(positions), 8);
    const frame = new FrameAssembly(2).add(part({ header: header(), positions: message.subarray(8, 32) }))!;
    expect(frame.positions).toEqual(positions);
    expect(frame.positions.buffer).toBe(message.buffer);
    expect(frame.distortion.length).toBe(0);
    expect(frame.wireBytes).toBe(24);
  });

  test("are copied as a whole where they are not aligned", () => {
    const message = new Uint8Array(64);
    message.set(bytesOf(positions), 3);
    const frame = new FrameAssembly(2).add(part({ header: header(), positions: message.subarray(3, 27) }))!;
    expect(frame.positions).toEqual(positions);
  });

  test("of doubles are so to the last bit, where they are expected", () => {
    const doubles = Float64Array.of(0.1, 1 / 3, 1e-300, -2, 1e17 + 16, 5);
    for (const offset of [8, 3]) {
      const message = new Uint8Array(64);
      message.set(bytesOf(doubles), offset);
      const init = { header: header({ scalar: Scalar.FLOAT64 }), positions: message.subarray(offset, offset + 48) };
      const frame = new FrameAssembly(2, true).add(part({ ...init, distortion: bytesOf(doubles.subarray(1, 3)) }))!;
      expect(frame.raw.positions).toEqual(doubles);
      expect(frame.raw.distortion).toEqual(doubles.subarray(1, 3));
      expect(frame.raw.positions.buffer === message.buffer).toBe(offset === 8);
    }
    expect(() => new FrameAssembly(2, true).add(part({ header: header(), positions: bytesOf(positions) }))).toThrow(
      expect.objectContaining({ reason: "FRAME_PARTS" }),
    );
  });

  test("of several parts are put together in order", () => {
    const assembly = new FrameAssembly(2);
    const first = positions.subarray(0, 3);
    const second = positions.subarray(3);
    const distortion = new Float32Array([0.5]);
    const common = { vertexCount: 1, distortion: bytesOf(distortion), normals: bytesOf(new Float32Array([0, 0, 1])) };
    expect(assembly.add(part({ ...common, header: header(), positions: bytesOf(first), last: false }))).toBeUndefined();
    const frame = assembly.add(part({ ...common, firstVertex: 1, positions: bytesOf(second) }))!;
    expect(frame.positions).toEqual(positions);
    expect(frame.distortion).toEqual(new Float32Array([0.5, 0.5]));
    expect(frame.normals).toEqual(new Float32Array([0, 0, 1, 0, 0, 1]));
  });
});

describe("quantized frames", () => {
  const init = {
    header: header({ encoding: Encoding.QUANTIZED, quantization }),
    positions: bytesOf(quantized),
    normals: bytesOf(quantizedNormals),
  };

  test("are ready as attributes and decode to numbers", () => {
    const frame = new FrameAssembly(2).add(part(init))!;
    expect(frame.quantized!.vertices).toEqual(quantized);
    expect(frame.quantized!.normals).toEqual(quantizedNormals);
    expect(frame.positions).toEqual(new Float32Array([-1, 0, 0, 2, 0, 0.5]));
    expect(frame.positions).toBe(frame.positions);
    expect(frame.distortion).toEqual(new Float32Array([0, 8]));
    expect(frame.normals).toEqual(new Float32Array([0, 0, 1, -1, 0, 0]));
  });

  test("decompress to the same", () => {
    const compressed = (array: ArrayBufferView) => MeshoptEncoder.encodeVertexBufferLevel(bytesOf(array), 2, 8, 2, 0);
    const frame = new FrameAssembly(2).add(
      part({
        header: header({ encoding: Encoding.COMPRESSED, quantization }),
        positions: compressed(quantized),
        normals: compressed(quantizedNormals),
      }),
    )!;
    expect(frame.quantized!.vertices).toEqual(quantized);
    expect(frame.quantized!.normals).toEqual(quantizedNormals);
  });

  test("of several parts are put together in order", () => {
    const assembly = new FrameAssembly(2);
    const one = { vertexCount: 1, normals: new Uint8Array(0) };
    assembly.add(part({ ...init, ...one, positions: bytesOf(quantized.subarray(0, 4)), last: false }));
    const frame = assembly.add(part({ ...one, firstVertex: 1, positions: bytesOf(quantized.subarray(4)) }))!;
    expect(frame.quantized!.vertices).toEqual(quantized);
    expect(frame.normals.length).toBe(0);
  });
});

describe("parts that do not fit", () => {
  const whole = { header: header(), positions: bytesOf(positions) };
  const cases: [string, PartInit[]][] = [
    ["a frame of another size", [{ ...whole, header: header({ vertexCount: 3 }) }]],
    ["float64", [{ ...whole, header: header({ scalar: Scalar.FLOAT64 }) }]],
    ["an encoding that nobody knows", [{ ...whole, header: header({ encoding: 9 as Encoding }) }]],
    ["a part without a beginning", [{ positions: bytesOf(positions) }]],
    ["a part of another frame", [{ ...whole, frameSeq: 8n }]],
    ["too few positions", [{ ...whole, positions: bytesOf(positions.subarray(1)) }]],
    ["too few distortions", [{ ...whole, distortion: new Uint8Array(4) }]],
    ["too few normals", [{ ...whole, normals: new Uint8Array(4) }]],
    ["half a number", [{ ...whole, positions: new Uint8Array(23) }]],
    ["an end too early", [{ ...whole, vertexCount: 1, positions: bytesOf(positions.subarray(3)) }]],
    ["more vertices than there are", [{ ...whole, vertexCount: 3, positions: new Uint8Array(36) }]],
    [
      "a gap",
      [
        { ...whole, vertexCount: 1, positions: bytesOf(positions.subarray(3)), last: false },
        { firstVertex: 2, vertexCount: 0 },
      ],
    ],
    ["bytes that are not compressed", [{ ...whole, header: header({ encoding: Encoding.COMPRESSED, quantization }) }]],
  ];
  test.each(cases)("%s", (_, parts) => {
    const assembly = new FrameAssembly(2);
    const addAll = () => parts.map((one) => assembly.add(part(one)));
    expect(addAll).toThrow(expect.objectContaining({ code: "data_loss", reason: "FRAME_PARTS" }));
    expect(assembly.add(part(whole))!.positions).toEqual(positions);
  });
});
