import { create } from "@bufbuild/protobuf";
import { LpdeformError } from "./errors.js";
import { stepBytes } from "./task.js";
import { type Buffer, BufferSchema, Scalar } from "./gen/lpdeform/v1/data_pb.js";

export type Numbers = Float32Array | Float64Array | readonly number[];
export type Indices = Uint32Array | readonly number[];

/**
 * Limit of the inline bytes in one message. More bytes are uploaded beforehand, so that no message exceeds the limit of
 * servers.
 */
const mostInlineBytes = 1 << 20;

/** Uploads bytes and returns the name by which a buffer refers to them. */
export type Upload = (bytes: Uint8Array) => Promise<string>;

/** Puts arrays into the buffers of one message. Call flush() before the message is sent. */
export class Packer {
  #left = mostInlineBytes;
  /** Whether the message takes a page some time to write and to send. */
  get isLarge(): boolean {
    return mostInlineBytes - this.#left > stepBytes / 8;
  }

  readonly #large: { buffer: Buffer; bytes: Uint8Array }[] = [];

  pack(bytes: Uint8Array): Buffer {
    const buffer = create(BufferSchema);
    if (bytes.byteLength <= this.#left) {
      this.#left -= bytes.byteLength;
      buffer.source = { case: "inline", value: bytes };
    } else {
      this.#large.push({ buffer, bytes });
    }
    return buffer;
  }

  numbers(numbers: Numbers): { scalar: Scalar; buffer: Buffer } {
    const { scalar, bytes } = bytesOfNumbers(numbers);
    return { scalar, buffer: this.pack(bytes) };
  }

  indices(indices: Indices): Buffer {
    return this.pack(bytesOfIndices(indices));
  }

  /** Uploads what was too large. */
  async flush(upload: Upload): Promise<void> {
    for (const { buffer, bytes } of this.#large) {
      buffer.source = { case: "upload", value: await upload(bytes) };
    }
    this.#large.length = 0;
  }
}

/** Little-endian, the byte order of every browser. */
export function bytesOfNumbers(numbers: Numbers): { scalar: Scalar; bytes: Uint8Array } {
  if (numbers instanceof Float32Array) return { scalar: Scalar.FLOAT32, bytes: bytesOf(numbers) };
  const doubles = numbers instanceof Float64Array ? numbers : Float64Array.from(numbers);
  return { scalar: Scalar.FLOAT64, bytes: bytesOf(doubles) };
}

/** Throws if a number is not an index: a Uint32Array would turn -1 into 4294967295, 1.5 into 1 and NaN into 0. */
export function bytesOfIndices(indices: Indices): Uint8Array {
  if (indices instanceof Uint32Array) return bytesOf(indices);
  const exact = Uint32Array.from(indices);
  const wrong = exact.findIndex((index, k) => index !== indices[k]);
  if (wrong < 0) return bytesOf(exact);
  throw new LpdeformError(
    "invalid_argument",
    `Number ${wrong} of the indices is ${indices[wrong]}, which is no index.`,
    {
      reason: "INDEX_OUT_OF_RANGE",
      element: `number ${wrong}`,
      limit: `0 <= index < ${2 ** 32}`,
    },
  );
}

function bytesOf(array: ArrayBufferView): Uint8Array {
  return new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
}
