import { LpdeformError } from "./errors.js";
import { stopReasonFromWire, methodName } from "./fromwire.js";
import { Scalar } from "./gen/lpdeform/v1/data_pb.js";
import type { FrameHeader, FramePart } from "./gen/lpdeform/v1/frame_pb.js";
import type { Frame } from "./types.js";

/**
 * Puts the parts of frames together. A frame of one part, as up to 65,000 vertices give, becomes views of the message that
 * carried it; of several parts, each is copied once as a whole. Whatever does not fit is an error (FRAME_PARTS).
 */
export class FrameAssembly {
  #frame: Frame | undefined;
  #received = 0;

  constructor(readonly vertexCount: number) {}

  /** The frame, where this part makes it whole. */
  add(part: FramePart): Frame | undefined {
    try {
      if (part.header) this.#begin(part.header);
      const frame = this.#append(part);
      frame.wireBytes += part.positions.byteLength + part.distortion.byteLength + part.normals.byteLength;
      if (!part.last) return undefined;
      frame.receivedAt = performance.now();
      this.#frame = undefined;
      return frame;
    } catch (misfit) {
      this.#frame = undefined;
      throw misfit;
    }
  }

  #begin(header: FrameHeader): void {
    if (header.vertexCount !== this.vertexCount) {
      throw misfit(`A frame has ${header.vertexCount} vertices, the mesh ${this.vertexCount}.`);
    }
    if (header.scalar !== Scalar.FLOAT32) throw misfit(`A frame comes in a scalar that was not asked for.`);
    this.#received = 0;
    this.#frame = {
      positions: none,
      distortion: none,
      normals: none,
      inputSeq: Number(header.inputSeq),
      frameSeq: Number(header.frameSeq),
      epoch: Number(header.epoch),
      skippedInputs: Number(header.skippedInputs),
      iteration: header.iteration,
      energy: header.energy,
      softEnergy: header.softEnergy,
      converged: header.converged,
      stopReason: stopReasonFromWire(header.stopReason),
      solveSeconds: header.solveSeconds,
      method: methodName(header.method),
      wireBytes: 0,
      receivedAt: 0,
    };
  }

  #append(part: FramePart): Frame {
    const frame = this.#frame;
    const count = part.vertexCount;
    if (!frame || Number(part.frameSeq) !== frame.frameSeq || part.firstVertex !== this.#received ||
        count > this.vertexCount - this.#received) {
      throw misfit(`The part of frame ${part.frameSeq} from vertex ${part.firstVertex} on does not follow what came before.`);
    }
    frame.positions = this.#join(frame.positions, part.positions, part, 3);
    if (part.distortion.length > 0) frame.distortion = this.#join(frame.distortion, part.distortion, part, 1);
    if (part.normals.length > 0) frame.normals = this.#join(frame.normals, part.normals, part, 3);
    this.#received += count;
    if (part.last && this.#received !== this.vertexCount) {
      throw misfit(`Frame ${part.frameSeq} ends after ${this.#received} of ${this.vertexCount} vertices.`);
    }
    return frame;
  }

  #join(whole: Float32Array, bytes: Uint8Array, part: FramePart, width: number): Float32Array {
    if (bytes.byteLength !== 4 * width * part.vertexCount) {
      throw misfit(`A part of frame ${part.frameSeq} has the wrong number of bytes for ${part.vertexCount} vertices.`);
    }
    const values = float32View(bytes);
    if (part.firstVertex === 0 && part.vertexCount === this.vertexCount) return values;
    const all = whole.length > 0 ? whole : new Float32Array(width * this.vertexCount);
    all.set(values, width * part.firstVertex);
    return all;
  }
}

const none = new Float32Array(0);

/** In place where the bytes lie at a multiple of four, as the server sees to; otherwise of one copy. */
export function float32View(bytes: Uint8Array): Float32Array {
  const aligned = bytes.byteOffset % 4 === 0 ? bytes : bytes.slice();
  return new Float32Array(aligned.buffer, aligned.byteOffset, aligned.byteLength / 4);
}

function misfit(text: string): LpdeformError {
  return new LpdeformError("data_loss", text, { reason: "FRAME_PARTS" });
}
