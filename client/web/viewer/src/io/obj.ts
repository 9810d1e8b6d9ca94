import type { Mesh, WrittenMesh } from "../model/mesh.js";
import { MeshBuilder } from "./builder.js";

/** The positions and faces of an OBJ file; texture coordinates, normals, groups and materials are left aside. */
export function readObj(name: string, text: string): Mesh {
  const builder = new MeshBuilder();
  let number = 0;
  for (const line of text.replace(/\\\r?\n/g, " ").split(/\r?\n|\r/)) {
    ++number;
    const [key, ...words] = line.trim().split(/\s+/);
    if (key === "v") {
      const [x = NaN, y = NaN, z = NaN] = words.map(Number);
      builder.vertex(x, y, z, `${name}, line ${number}`);
    } else if (key === "f") {
      const end = words.findIndex((word) => word.startsWith("#"));
      const corners = (end < 0 ? words : words.slice(0, end)).map((word) => cornerOf(word, builder.vertexCount));
      builder.polygon(corners, `${name}, line ${number}`);
    }
  }
  return builder.finish(name);
}

/** Numbers count from 1, negative ones back from the newest vertex. */
function cornerOf(word: string, vertexCount: number): number {
  const number = Number(word.split("/")[0]);
  return number < 0 ? vertexCount + number : number - 1;
}

export function writeObj({ positions, faces }: WrittenMesh): string {
  const lines: string[] = [];
  for (let k = 0; k < positions.length; k += 3) lines.push(`v ${positions[k]} ${positions[k + 1]} ${positions[k + 2]}`);
  for (let k = 0; k < faces.length; k += 3) lines.push(`f ${faces[k]! + 1} ${faces[k + 1]! + 1} ${faces[k + 2]! + 1}`);
  return `${lines.join("\n")}\n`;
}
