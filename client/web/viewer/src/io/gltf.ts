import { Vector3 } from "three";
import type { Mesh, WrittenMesh } from "../model/mesh.js";
import { MeshBuilder } from "./builder.js";
import { float, readNumbers } from "./gltf_accessors.js";
import { readBlocks } from "./gltf_blocks.js";
import { type GltfDocument, listOf, readGltfDocument, writeGlb } from "./gltf_document.js";

/**
 * What the scene of a GLB or glTF draws as triangles, where it is drawn, as one mesh; and the file as a GLB, so that it can be
 * saved with the mesh deformed. `beside`: files that were opened with it, by name. Throws a FileFault.
 */
export function readGltf(name: string, bytes: Uint8Array, beside: ReadonlyMap<string, Uint8Array> = new Map()): Mesh {
  const document = readGltfDocument(name, bytes, beside);
  const { blocks, faces, left } = readBlocks(document);
  const builder = new MeshBuilder();
  const place = new Vector3();
  for (const { position, placement, node } of blocks) {
    const numbers = readNumbers(document, position, 3);
    for (let k = 0; k < numbers.length; k += 3) {
      place.fromArray(numbers, k).applyMatrix4(placement);
      builder.vertex(place.x, place.y, place.z, `${name}, node ${node}`);
    }
  }
  for (let k = 0; k < faces.length; k += 3) builder.polygon([faces[k]!, faces[k + 1]!, faces[k + 2]!], name);
  const { json } = document;
  if (listOf(json, "materials").length > 0) builder.leftAside("materials");
  if (listOf(json, "images").length > 0) builder.leftAside("textures");
  if (listOf(json, "skins").length > 0) builder.leftAside("skins");
  if (listOf(json, "animations").length > 0) builder.leftAside("animations");
  if (blocks.some(({ normal }) => normal !== undefined)) builder.leftAside("normals");
  const attributes = listOf(json, "meshes").flatMap((mesh) => listOf(mesh, "primitives").map((one) => JSON.stringify(one)));
  if (attributes.some((text) => text.includes("TEXCOORD_0"))) builder.leftAside("texture coordinates");
  if (attributes.some((text) => text.includes('"targets"'))) builder.leftAside("morph targets");
  for (const what of left) builder.leftAside(what);
  return { ...builder.finish(name), gltf: writeGlb(document) };
}

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
