import type { Mesh } from "./mesh.js";
import { utf16Of } from "./encodings.js";
import { FileFault } from "./fault.js";
import { readGltf } from "./gltf.js";
import { readObj } from "./obj.js";
import { readOff } from "./off.js";
import { readPly } from "./ply.js";
import { readStl } from "./stl.js";

/** The endings of names that parseMesh() reads. */
export const readable = /\.(glb|gltf|off|obj|ply|stl)$/i;

/** Reads a mesh file by the ending of its name. `beside`: what was opened with it, by name. Throws a FileFault. */
export function parseMesh(name: string, bytes: Uint8Array, beside?: ReadonlyMap<string, Uint8Array>): Mesh {
  switch (name.toLowerCase().split(".").at(-1)) {
    case "glb":
    case "gltf":
      return readGltf(name, bytes, beside);
    case "off":
      return readOff(name, textOf(name, bytes));
    case "obj":
      return { ...readObj(name, textOf(name, bytes)), obj: bytes, ...materialsIn(beside) };
    case "ply": {
      const mesh = readPly(name, bytes);
      return mesh.beside ? { ...mesh, ply: bytes } : mesh;
    }
    case "stl":
      return readStl(name, bytes);
    default:
      throw new FileFault(`${name} is not a mesh that can be read: GLB, glTF, OFF, OBJ, PLY and STL can.`);
  }
}

function materialsIn(beside: ReadonlyMap<string, Uint8Array> = new Map()): Pick<Mesh, "materials"> {
  const files = [...beside].map(([name, bytes]) => [name, new Blob([bytes as Uint8Array<ArrayBuffer>])] as const);
  return files.some(([name]) => /\.mtl$/i.test(name)) ? { materials: Object.fromEntries(files) } : {};
}

function textOf(name: string, bytes: Uint8Array): string {
  if (utf16Of(bytes)) throw new FileFault(`${name} is in UTF-16; save it as UTF-8.`);
  return new TextDecoder().decode(bytes);
}
