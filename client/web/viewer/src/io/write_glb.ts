import { float } from "lpdeform-client/mesh/gltf_accessors";
import { type GltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
import type { WrittenMesh } from "lpdeform-client/mesh/mesh";

/** A GLB with the mesh and nothing else. Numbers are float32. */
export function newGlb({ positions, faces }: WrittenMesh): Uint8Array<ArrayBuffer> {
  const points = Float32Array.from(positions);
  const corners = Uint32Array.from(faces);
  const buffer = new Uint8Array(points.byteLength + corners.byteLength);
  buffer.set(new Uint8Array(points.buffer));
  buffer.set(new Uint8Array(corners.buffer), points.byteLength);
  const json = {
    asset: { version: "2.0", generator: "lpdeform" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [
      { bufferView: 0, componentType: float, count: points.length / 3, type: "VEC3", ...boundsOf(points, 3) },
      { bufferView: 1, componentType: 5125, count: corners.length, type: "SCALAR" },
    ],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: points.byteLength, target: 34962 },
      { buffer: 0, byteOffset: points.byteLength, byteLength: corners.byteLength, target: 34963 },
    ],
    buffers: [{ byteLength: buffer.length }],
  };
  return writeGlb({ json, buffer } satisfies GltfDocument);
}

/** The “min” and “max” of an accessor. */
export function boundsOf(numbers: Float32Array, width: number): { min: number[]; max: number[] } {
  const min: number[] = new Array<number>(width).fill(Infinity);
  const max: number[] = new Array<number>(width).fill(-Infinity);
  numbers.forEach((number, k) => {
    min[k % width] = Math.min(min[k % width]!, number);
    max[k % width] = Math.max(max[k % width]!, number);
  });
  return { min, max };
}
