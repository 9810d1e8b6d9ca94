import { decompress, float32View, float64View, uint16View } from "./decode.js";
import { LpdeformError } from "./errors.js";
import { WireFrame } from "./frame.js";
import { Scalar } from "./gen/lpdeform/v1/data_pb.js";
import { Encoding, type FrameHeader, type FramePart } from "./gen/lpdeform/v1/frame_pb.js";
import type { Packed } from "./types.js";

type Numbers = Float32Array | Float64Array | Uint16Array | Int16Array;

/**
 * Assembles frames from their parts. A frame of one part, with up to about 50,000 vertices, becomes views of the message that
 * carried it. For a frame of several parts, each part is copied once. A part that does not fit is an error (FRAME_PARTS).
 */
export class FrameAssembly {
  #frame: WireFrame | undefined;
  #isCompressed = false;
  #received = 0;
  #withDistortion = 0; // how many vertices with distortion have come
  #withNormals = 0;

  /** `isDouble`: raw numbers are doubles. `isPacked`: quantized frames are left as they come, for an Unpacker. */
  constructor(
    readonly vertexCount: number,
    readonly isDouble = false,
    readonly isPacked = false,
  ) {}

  /** The frame, if this part completes it. */
  add(part: FramePart): WireFrame | undefined {
    const frame = part.header ? this.#begin(part.header) : this.#frame;
    this.#frame = undefined;
    if (!frame || !this.#follows(frame, part)) {
      throw misfit(
        `The part of frame ${part.frameSeq} from vertex ${part.firstVertex} on does not follow what came before.`,
      );
    }
    if (frame.packed) this.#appendPacked(frame.packed, part);
    else if (frame.quantized) this.#appendQuantized(frame.quantized, part);
    else this.#appendRaw(frame, part);
    frame.wireBytes += part.positions.byteLength + part.distortion.byteLength + part.normals.byteLength;
    this.#received += part.vertexCount;
    if (part.distortion.length > 0) this.#withDistortion += part.vertexCount;
    if (part.normals.length > 0) this.#withNormals += part.vertexCount;
    if (!part.last) {
      this.#frame = frame;
      return undefined;
    }
    if (this.#received !== this.vertexCount) {
      throw misfit(`Frame ${part.frameSeq} ends after ${this.#received} of ${this.vertexCount} vertices.`);
    }
    if ([this.#withDistortion, this.#withNormals].some((count) => count !== 0 && count !== this.vertexCount)) {
      throw misfit(`Frame ${part.frameSeq} has distortion or normals for a part of its vertices.`);
    }
    frame.receivedAt = performance.now();
    return frame;
  }

  #begin(header: FrameHeader): WireFrame {
    if (header.vertexCount !== this.vertexCount) {
      throw misfit(`A frame has ${header.vertexCount} vertices, the mesh ${this.vertexCount}.`);
    }
    this.#received = this.#withDistortion = this.#withNormals = 0;
    this.#isCompressed = header.encoding === Encoding.COMPRESSED;
    const frame = new WireFrame(header);
    if (this.#isCompressed || header.encoding === Encoding.QUANTIZED) {
      const { origin, extent, distortionExtent = 0 } = header.quantization ?? {};
      const quantization = {
        origin: [origin?.x ?? 0, origin?.y ?? 0, origin?.z ?? 0],
        extent: [extent?.x ?? 0, extent?.y ?? 0, extent?.z ?? 0],
        distortionExtent,
      } as const;
      const { vertexCount } = this;
      frame.quantized = { vertices: new Uint16Array(0), normals: new Int16Array(0), ...quantization };
      if (this.isPacked) frame.packed = { vertexCount, isCompressed: this.#isCompressed, quantization, parts: [] };
    } else if ((header.scalar === Scalar.FLOAT64) !== this.isDouble || header.encoding > Encoding.COMPRESSED) {
      throw misfit("A frame comes in an encoding that was not asked for.");
    }
    return frame;
  }

  #follows(frame: WireFrame, part: FramePart): boolean {
    return (
      Number(part.frameSeq) === frame.frameSeq &&
      part.firstVertex === this.#received &&
      part.vertexCount <= this.vertexCount - this.#received
    );
  }

  #appendRaw({ raw }: WireFrame, part: FramePart): void {
    const { positions, distortion, normals } = part;
    const numbers: (bytes: Uint8Array) => Float32Array | Float64Array = this.isDouble ? float64View : float32View;
    raw.positions = this.#join(raw.positions, numbers(positions), positions, 3, part);
    if (distortion.length > 0) raw.distortion = this.#join(raw.distortion, numbers(distortion), distortion, 1, part);
    if (normals.length > 0) raw.normals = this.#join(raw.normals, numbers(normals), normals, 3, part);
  }

  /** Copies the part: to give its bytes to a worker is to give the whole message. */
  #appendPacked({ isCompressed, parts }: Packed, part: FramePart): void {
    const { firstVertex, vertexCount, positions, normals } = part;
    for (const bytes of [positions, normals]) {
      const isRight = bytes.length === 8 * vertexCount || (bytes === normals && bytes.length === 0);
      if (!isCompressed && !isRight) throw wrongSize(part);
    }
    parts.push({ firstVertex, vertexCount, vertices: positions.slice(), normals: normals.slice() });
  }

  #appendQuantized(quantized: NonNullable<WireFrame["quantized"]>, part: FramePart): void {
    const bytesOf = (bytes: Uint8Array) => (this.#isCompressed ? decompress(bytes, part.vertexCount) : bytes);
    const vertices = bytesOf(part.positions);
    quantized.vertices = this.#join(quantized.vertices, uint16View(vertices), vertices, 4, part);
    if (part.normals.length === 0) return;
    const normals = bytesOf(part.normals);
    const { buffer, byteOffset, length } = uint16View(normals);
    quantized.normals = this.#join(quantized.normals, new Int16Array(buffer, byteOffset, length), normals, 4, part);
  }

  /**
   * Puts `values`, the numbers of `bytes`, at their place in the whole array. The first part makes that array; if it has all
   * values, it is the array.
   */
  #join<Array extends Numbers>(whole: Array, values: Array, bytes: Uint8Array, width: number, part: FramePart): Array {
    const isWhole = bytes.byteLength === values.byteLength;
    if (!isWhole || values.length !== width * part.vertexCount) {
      throw wrongSize(part);
    }
    if (part.vertexCount === this.vertexCount) return values;
    const all =
      whole.length > 0 ? whole : new (values.constructor as new (length: number) => Array)(width * this.vertexCount);
    all.set(values, width * part.firstVertex);
    return all;
  }
}

function wrongSize({ frameSeq, vertexCount }: FramePart): LpdeformError {
  return misfit(`A part of frame ${frameSeq} has the wrong number of bytes for ${vertexCount} vertices.`);
}

function misfit(text: string): LpdeformError {
  return new LpdeformError("data_loss", text, { reason: "FRAME_PARTS" });
}
