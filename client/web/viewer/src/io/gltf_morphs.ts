import { float } from "lpdeform-client/mesh/gltf_accessors";
import { boundsOf } from "./write_glb.js";
import { type Part, writeGlb } from "lpdeform-client/mesh/gltf_document";

/** A surface at one moment of a film. */
export interface Still {
  name: string;
  positions: Float32Array;
  /** Of any length. */
  normals: Float32Array;
}

const [vertexData, indexData, uint32] = [34962, 34963, 5125];

/** Arrays one after the other, and the accessors that say what they are. */
class Contents {
  readonly accessors: Part[] = [];
  readonly views: Part[] = [];
  readonly #arrays: Uint8Array[] = [];
  #size = 0;

  add(numbers: Float32Array | Uint32Array, width: 1 | 3, target?: number): number {
    const bytes = new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength);
    const isIndex = numbers instanceof Uint32Array;
    this.views.push({ buffer: 0, byteOffset: this.#size, byteLength: bytes.length, ...(target && { target }) });
    this.#arrays.push(bytes);
    this.#size += bytes.length;
    return (
      this.accessors.push({
        bufferView: this.views.length - 1,
        componentType: isIndex ? uint32 : float,
        count: numbers.length / width,
        type: width === 3 ? "VEC3" : "SCALAR",
        ...(!isIndex && boundsOf(numbers, width)),
      }) - 1
    );
  }

  /** All arrays as one. */
  get buffer(): Uint8Array {
    const buffer = new Uint8Array(this.#size);
    this.#arrays.forEach((bytes, k) => buffer.set(bytes, this.views[k]!["byteOffset"] as number));
    return buffer;
  }
}

/**
 * A GLB of a mesh with morph targets: the first still is the mesh, the others are its targets, and an animation goes through all of
 * them, `secondsEach` from one to the next. Two stills at least, all of the same vertices.
 */
export function morphGlb(
  name: string,
  indices: Uint32Array,
  [first, ...others]: readonly Still[],
  secondsEach: number,
): Uint8Array<ArrayBuffer> {
  const contents = new Contents();
  const normals = unit(first!.normals);
  const attributes = {
    POSITION: contents.add(first!.positions, 3, vertexData),
    NORMAL: contents.add(normals, 3, vertexData),
  };
  const targets = others.map((still) => ({
    POSITION: contents.add(minus(still.positions, first!.positions), 3, vertexData),
    NORMAL: contents.add(minus(unit(still.normals), normals), 3, vertexData),
  }));
  const times = Float32Array.from({ length: others.length + 1 }, (_, k) => k * secondsEach);
  const weights = new Float32Array(times.length * others.length);
  others.forEach((_, k) => (weights[(k + 1) * others.length + k] = 1));
  const sampler = { input: contents.add(times, 1), output: contents.add(weights, 1), interpolation: "LINEAR" };
  const indexed = contents.add(indices, 1, indexData);
  const { buffer } = contents;
  const json = {
    asset: { version: "2.0", generator: "lpdeform" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, name }],
    meshes: [
      {
        name,
        primitives: [{ attributes, indices: indexed, targets }],
        weights: others.map(() => 0),
        extras: { targetNames: others.map((still) => still.name) },
      },
    ],
    animations: [{ name: "Poses", samplers: [sampler], channels: [{ sampler: 0, target: { node: 0, path: "weights" } }] }],
    accessors: contents.accessors,
    bufferViews: contents.views,
    buffers: [{ byteLength: buffer.length }],
  };
  return writeGlb({ json, buffer });
}

function minus(a: Float32Array, b: Float32Array): Float32Array {
  return a.map((value, k) => value - b[k]!);
}

/** The vectors with length 1; those of length 0 point up. */
function unit(vectors: Float32Array): Float32Array {
  const result = vectors.slice();
  for (let k = 0; k < result.length; k += 3) {
    const length = Math.hypot(result[k]!, result[k + 1]!, result[k + 2]!);
    if (length === 0) result[k + 2] = 1;
    else for (let axis = 0; axis < 3; ++axis) result[k + axis]! /= length;
  }
  return result;
}
