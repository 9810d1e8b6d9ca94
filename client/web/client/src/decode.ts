import { LpdeformError } from "./errors.js";
import type { QuantizedSurface } from "./types.js";

/** A view if the bytes are aligned to a multiple of four, which the server makes sure of; otherwise a copy. */
export function float32View(bytes: Uint8Array): Float32Array {
  const aligned = bytes.byteOffset % 4 === 0 ? bytes : bytes.slice();
  return new Float32Array(aligned.buffer, aligned.byteOffset, aligned.byteLength / 4);
}

/** Like float32View(), aligned to a multiple of eight. */
export function float64View(bytes: Uint8Array): Float64Array {
  const aligned = bytes.byteOffset % 8 === 0 ? bytes : bytes.slice();
  return new Float64Array(aligned.buffer, aligned.byteOffset, aligned.byteLength / 8);
}

export function uint16View(bytes: Uint8Array): Uint16Array {
  const aligned = bytes.byteOffset % 2 === 0 ? bytes : bytes.slice();
  return new Uint16Array(aligned.buffer, aligned.byteOffset, aligned.byteLength / 2);
}

const mostUnsigned = 65535;
const mostSigned = 32767;

/** x, y, z of each vertex. */
export function positionsOf({ vertices, origin, extent }: QuantizedSurface): Float32Array {
  const count = vertices.length / 4;
  const positions = new Float32Array(3 * count);
  const [x, y, z] = origin;
  const [dx, dy, dz] = extent.map((length) => length / mostUnsigned) as [number, number, number];
  for (let k = 0; k < count; ++k) {
    positions[3 * k] = x + dx * vertices[4 * k]!;
    positions[3 * k + 1] = y + dy * vertices[4 * k + 1]!;
    positions[3 * k + 2] = z + dz * vertices[4 * k + 2]!;
  }
  return positions;
}

/** E_i of each vertex. */
export function distortionOf({ vertices, distortionExtent }: QuantizedSurface): Float32Array {
  const count = vertices.length / 4;
  const distortion = new Float32Array(count);
  const step = distortionExtent / mostUnsigned;
  for (let k = 0; k < count; ++k) distortion[k] = step * vertices[4 * k + 3]!;
  return distortion;
}

/** x, y, z of each normal. */
export function normalsOf({ normals }: QuantizedSurface): Float32Array {
  const count = normals.length / 4;
  const out = new Float32Array(3 * count);
  for (let k = 0; k < count; ++k) {
    for (let axis = 0; axis < 3; ++axis) out[3 * k + axis] = normals[4 * k + axis]! / mostSigned;
  }
  return out;
}

type Decoder = (typeof import("meshoptimizer/decoder"))["MeshoptDecoder"];
let decoder: Decoder | undefined;

/** Loads meshoptimizer's decoder, only if it is needed. Await it before the first compressed frame. */
export async function loadDecompressor(): Promise<void> {
  if (decoder) return;
  const { MeshoptDecoder } = await import("meshoptimizer/decoder");
  await MeshoptDecoder.ready;
  decoder = MeshoptDecoder;
}

/** Decompresses a block of `count` times four 16-bit integers. */
export function decompress(block: Uint8Array, count: number): Uint8Array {
  const bytes = new Uint8Array(8 * count);
  try {
    if (!decoder) throw new Error("the decoder is not loaded");
    decoder.decodeVertexBuffer(bytes, count, 8, block);
  } catch (cause) {
    throw new LpdeformError(
      "data_loss",
      `A compressed part of ${count} vertices cannot be read.`,
      { reason: "FRAME_PARTS" },
      cause,
    );
  }
  return bytes;
}
