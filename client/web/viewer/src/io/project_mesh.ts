import { type Mesh, polygonsOf } from "lpdeform-client/mesh/mesh";
import { MeshBuilder } from "lpdeform-client/mesh/builder";
import { FileFault } from "lpdeform-client/mesh/fault";
import { readGltf } from "lpdeform-client/mesh/gltf";
import { readObj } from "lpdeform-client/mesh/obj";
import { readPly } from "lpdeform-client/mesh/ply";
import { isObject, type Sections } from "./sections.js";

/** Where each part of a mesh goes in a project; what is “again” comes from the source when that is read. One that is missing does not compile. */
const parts: { readonly [K in keyof Required<Mesh>]: "head" | "array" | "source" | "files" | "again" } = {
  name: "head",
  positions: "array",
  exact: "array",
  faces: "array",
  corners: "array",
  beside: "head",
  notices: "again",
  obj: "source",
  materials: "files",
  gltf: "source",
  ply: "source",
};

interface Stored {
  head: object;
  arrays: Sections;
}

/** Comes before the names of files that were opened with an OBJ. */
const filePrefix = "materials/";

/**
 * The file that the mesh came from and those that were opened with it, if the mesh has them, or otherwise its arrays. Rejects if the
 * browser no longer has a file.
 */
export async function storedMesh(mesh: Mesh): Promise<Stored> {
  const { name, beside = [], exact, positions, faces, corners, materials = {} } = mesh;
  const source = (Object.keys(parts) as (keyof Mesh)[]).find((part) => parts[part] === "source" && mesh[part]);
  if (source) {
    const read = async ([file, blob]: [string, Blob]) => [filePrefix + file, new Uint8Array(await blob.arrayBuffer())] as const;
    const files = Object.fromEntries(await Promise.all(Object.entries(materials).map(read)));
    return { head: { name, source }, arrays: { [source]: mesh[source] as Uint8Array, ...files } };
  }
  return {
    head: { name, beside },
    arrays: { positions: exact ?? positions, faces, ...(corners && { corners }) },
  };
}

/** Throws a FileFault that names `file` and the place. */
export function readStoredMesh(json: unknown, arrays: Sections, file: string): Mesh {
  const { name, source, beside } = isObject(json) ? json : {};
  if (typeof name !== "string" || name.length > 1000) throw new FileFault(`In ${file}, the mesh has no name.`);
  if (source === "obj" && arrays["obj"] instanceof Uint8Array) {
    const { obj } = arrays;
    return { ...readObj(name, new TextDecoder().decode(obj)), obj, ...materialsIn(arrays) };
  }
  if (source === "ply" && arrays["ply"] instanceof Uint8Array) return { ...readPly(name, arrays["ply"]), ply: arrays["ply"] };
  if (source === "gltf" && arrays["gltf"] instanceof Uint8Array) return readGltf(name, arrays["gltf"]);
  const { positions, faces, corners } = arrays;
  const isOfNumbers = positions instanceof Float32Array || positions instanceof Float64Array;
  if (!isOfNumbers || positions.length % 3 !== 0) throw new FileFault(`In ${file}, the mesh has no positions.`);
  if (!(faces instanceof Uint32Array) || faces.length % 3 !== 0) throw new FileFault(`In ${file}, the mesh has no faces.`);
  const builder = new MeshBuilder();
  for (let k = 0; k < positions.length; k += 3) {
    builder.vertex(positions[k]!, positions[k + 1]!, positions[k + 2]!, `Vertex ${k / 3} of ${file}`);
  }
  let face = 0;
  for (const polygon of polygonsOf({ faces, ...(corners && { corners: cornersOf(corners, faces, file) }) })) {
    builder.polygon(polygon, `Face ${face++} of ${file}`);
  }
  if (Array.isArray(beside)) for (const what of beside) if (typeof what === "string") builder.leftAside(what);
  return { ...builder.finish(file), name };
}

function materialsIn(arrays: Sections): Pick<Mesh, "materials"> {
  const files = Object.entries(arrays).flatMap(([name, bytes]) =>
    name.startsWith(filePrefix) ? [[name.slice(filePrefix.length), new Blob([bytes as BlobPart])] as const] : [],
  );
  return files.length > 0 ? { materials: Object.fromEntries(files) } : {};
}

function cornersOf(corners: Sections[string], faces: Uint32Array, file: string): Uint32Array {
  let triangles = 0;
  for (const count of corners) triangles += count < 3 ? NaN : count - 2;
  if (corners instanceof Uint32Array && 3 * triangles === faces.length) return corners;
  throw new FileFault(`In ${file}, the numbers of corners do not fit the faces.`);
}
