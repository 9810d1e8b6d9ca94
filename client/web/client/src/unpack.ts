import { decompress, distortionOf, loadDecompressor, normalsOf, positionsOf, uint16View } from "./decode.js";
import { LpdeformError } from "./errors.js";
import { largeVertices } from "./task.js";
import type { FrameUnpacker, Packed, Unpacked } from "./types.js";

/** Needs loadDecompressor() for compressed frames. Throws a LpdeformError (FRAME_PARTS) if a block cannot be read. */
export function unpack({ vertexCount, isCompressed, quantization, parts }: Packed): Unpacked {
  const hasNormals = parts.some(({ normals }) => normals.length > 0);
  const vertices = new Uint16Array(4 * vertexCount);
  const normals = new Uint16Array(hasNormals ? 4 * vertexCount : 0);
  for (const part of parts) {
    const numbers = (block: Uint8Array) => uint16View(isCompressed ? decompress(block, part.vertexCount) : block);
    vertices.set(numbers(part.vertices), 4 * part.firstVertex);
    if (hasNormals) normals.set(numbers(part.normals), 4 * part.firstVertex);
  }
  const quantized = { ...quantization, vertices, normals: new Int16Array(normals.buffer) };
  return {
    quantized,
    positions: positionsOf(quantized),
    distortion: distortionOf(quantized),
    normals: normalsOf(quantized),
  };
}

export interface UnpackRequest {
  id: number;
  packed: Packed;
}

export type UnpackAnswer = { id: number; unpacked: Unpacked } | { id: number; fault: string };

/**
 * Unpacks frames in a worker of the page, in the order in which they are given; or in the page itself if it can have none, or if
 * the worker cannot be loaded.
 */
export class Unpacker implements FrameUnpacker {
  #worker: Worker | undefined;
  /** Whether the worker has answered; until then it may turn out that it cannot be loaded. */
  #isProven = false;
  #lastId = 0;
  readonly #waiting = new Map<
    number,
    { packed: Packed; done: (unpacked: Unpacked) => void; failed: (error: unknown) => void }
  >();

  constructor() {
    try {
      this.#worker = new Worker(new URL("./unpack_worker.js", import.meta.url), { type: "module" });
      this.#worker.onmessage = ({ data }: MessageEvent<UnpackAnswer>) => this.#take(data);
      this.#worker.onerror = () => this.#goOnInPage();
    } catch {
      this.#worker = undefined;
    }
  }

  unpack(packed: Packed): Promise<Unpacked> {
    if (!this.#worker) return unpackLoaded(packed);
    const id = ++this.#lastId;
    const bytes = packed.parts.flatMap(({ vertices, normals }) => [vertices.buffer, normals.buffer] as ArrayBuffer[]);
    this.#worker.postMessage({ id, packed } satisfies UnpackRequest, this.#isProven ? bytes : []);
    return new Promise((done, failed) => this.#waiting.set(id, { packed, done, failed }));
  }

  #take(answer: UnpackAnswer): void {
    this.#isProven = true;
    const waiting = this.#waiting.get(answer.id);
    this.#waiting.delete(answer.id);
    if ("unpacked" in answer) waiting?.done(answer.unpacked);
    else waiting?.failed(new LpdeformError("data_loss", answer.fault, { reason: "FRAME_PARTS" }));
  }

  #goOnInPage(): void {
    this.#worker?.terminate();
    this.#worker = undefined;
    for (const { packed, done, failed } of this.#waiting.values()) {
      // What was handed over to a worker that had answered before is gone.
      if (this.#isProven) failed(new LpdeformError("unavailable", "The worker that unpacks frames has ended."));
      else unpackLoaded(packed).then(done, failed);
    }
    this.#waiting.clear();
  }
}

/** unpack() with its decoder. */
export async function unpackLoaded(packed: Packed): Promise<Unpacked> {
  if (packed.isCompressed) await loadDecompressor();
  return unpack(packed);
}

let shared: Unpacker | undefined;

/** The page's unpacker, for frames of so many vertices; undefined for small ones, and outside of pages. */
export function unpackerFor(vertexCount: number): Unpacker | undefined {
  if (vertexCount < largeVertices || typeof Worker === "undefined") return undefined;
  return (shared ??= new Unpacker());
}
