import { distortionOf, normalsOf, positionsOf } from "./decode.js";
import { methodName, stopReasonFromWire } from "./fromwire.js";
import type { FrameHeader } from "./gen/lpdeform/v1/frame_pb.js";
import type { DoubleSurface, Frame, Packed, QuantizedSurface, Shaded, StopReason, Unpacked } from "./types.js";

type Surface<Numbers> = Record<"positions" | "distortion" | "normals", Numbers>;

const none = new Float32Array(0);
const noDoubles = new Float64Array(0);

/** A frame as it is assembled. Its numbers are stored as received, or decoded when they are first read. */
export class WireFrame implements Frame {
  readonly inputSeq: number;
  readonly frameSeq: number;
  readonly epoch: number;
  skippedInputs: number;
  readonly iteration: number;
  readonly energy: number;
  readonly softEnergy: number;
  readonly isFinal: boolean;
  readonly stopReason: StopReason;
  readonly optimalityGap: number | undefined;
  readonly solveSeconds: number;
  readonly method: string;
  wireBytes = 0;
  receivedAt = 0;
  /** Doubles only if FrameAssembly was told to expect them. */
  raw: Surface<Float32Array | Float64Array> = { positions: none, distortion: none, normals: none };
  quantized: QuantizedSurface | undefined;
  shaded: Shaded | undefined;
  /** As it came, if it has to be unpacked before anybody sees it. */
  packed: Packed | undefined;
  readonly #decoded: Partial<Surface<Float32Array>> = {};

  constructor(header: FrameHeader) {
    this.inputSeq = Number(header.inputSeq);
    this.frameSeq = Number(header.frameSeq);
    this.epoch = Number(header.epoch);
    this.skippedInputs = Number(header.skippedInputs);
    this.iteration = header.iteration;
    this.energy = header.energy;
    this.softEnergy = header.softEnergy;
    this.isFinal = header.isFinal;
    this.stopReason = stopReasonFromWire(header.stopReason);
    this.optimalityGap = header.certificate?.relativeGap;
    this.solveSeconds = header.solveSeconds;
    this.method = methodName(header.method);
  }

  take({ quantized, shaded, ...decoded }: Unpacked & { shaded?: Shaded }): void {
    this.packed = undefined;
    this.quantized = quantized;
    this.shaded = shaded;
    Object.assign(this.#decoded, decoded);
  }

  get positions(): Float32Array {
    if (!this.quantized) return this.#singles("positions");
    return (this.#decoded.positions ??= positionsOf(this.quantized));
  }

  get distortion(): Float32Array {
    if (!this.quantized) return this.#singles("distortion");
    return (this.#decoded.distortion ??= distortionOf(this.quantized));
  }

  get normals(): Float32Array {
    if (!this.quantized) return this.#singles("normals");
    return (this.#decoded.normals ??= normalsOf(this.quantized));
  }

  get doubles(): DoubleSurface | undefined {
    if (!(this.raw.positions instanceof Float64Array)) return undefined;
    const [distortion, normals] = [this.raw.distortion, this.raw.normals].map((one) =>
      one instanceof Float64Array ? one : noDoubles,
    );
    return { positions: this.raw.positions, distortion: distortion!, normals: normals! };
  }

  #singles(what: keyof Surface<unknown>): Float32Array {
    const numbers = this.raw[what];
    return numbers instanceof Float32Array ? numbers : (this.#decoded[what] ??= Float32Array.from(numbers));
  }
}
