import { type mat4, vec3 } from "gl-matrix";
import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { readNumbers } from "./gltf_accessors.js";
import { readBlocks } from "./gltf_blocks.js";
import { listOf, readGltfDocument, writeGlb } from "./gltf_document.js";

/**
 * What the scene of a GLB or glTF draws as triangles, where it is drawn, as one mesh; and the file as a GLB, so that it can be
 * saved with the mesh deformed. `beside`: files that were opened with it, by name. Throws a FileFault.
 */
export function readGltf(name: string, bytes: Uint8Array, beside: ReadonlyMap<string, Uint8Array> = new Map()): Mesh {
  const document = readGltfDocument(name, bytes, beside);
  const { blocks, faces, left, notices } = readBlocks(document);
  const builder = new MeshBuilder();
  const place: [number, number, number] = [0, 0, 0];
  for (const { position, placement, node } of blocks) {
    const numbers = readNumbers(document, position, 3);
    for (let k = 0; k < numbers.length; k += 3) {
      vec3.transformMat4(place, numbers.subarray(k, k + 3) as unknown as vec3, placement as mat4);
      builder.vertex(...place, `${name}, node ${node}`);
    }
  }
  for (let k = 0; k < faces.length; k += 3) builder.polygon([faces[k]!, faces[k + 1]!, faces[k + 2]!], name);
  const { json } = document;
  if (listOf(json, "materials").length > 0) builder.leftAside("materials");
  if (listOf(json, "images").length > 0) builder.leftAside("textures");
  if (listOf(json, "skins").length > 0) builder.leftAside("skins");
  if (listOf(json, "animations").length > 0) builder.leftAside("animations");
  if (blocks.some(({ normal }) => normal !== undefined)) builder.leftAside("normals");
  const attributes = listOf(json, "meshes").flatMap((mesh) =>
    listOf(mesh, "primitives").map((one) => JSON.stringify(one)),
  );
  if (attributes.some((text) => text.includes("TEXCOORD_0"))) builder.leftAside("texture coordinates");
  if (attributes.some((text) => text.includes('"targets"'))) builder.leftAside("morph targets");
  for (const what of left) builder.leftAside(what);
  return { ...builder.finish(name), ...(notices.size > 0 && { notices: [...notices] }), gltf: writeGlb(document) };
}
