import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";
import { cornerOf, logicalLines } from "./obj_lines.js";

/** What a keyword of an OBJ file stands for that a mesh here cannot hold. */
const beside: Readonly<Record<string, string>> = {
  vt: "texture coordinates",
  vn: "normals",
  g: "groups",
  o: "objects",
  s: "smoothing groups",
  usemtl: "materials",
  mtllib: "materials",
  l: "lines",
  p: "points",
  curv: "curves",
  surf: "curved surfaces",
};

/** The positions and faces of an OBJ file. Other contents are only named. */
export function readObj(name: string, text: string): Mesh {
  const builder = new MeshBuilder();
  let [least, most, areWhole] = [0, 0, true];
  let face = 0;
  for (const { words, number } of logicalLines(text)) {
    const [key, ...values] = words;
    if (key === "v") {
      const [x = NaN, y = NaN, z = NaN] = values.map(Number);
      builder.vertex(x, y, z, () => `${name}, line ${number}, vertex ${builder.vertexCount + 1}`);
      if (values.length > 5) builder.leftAside("colours of vertices");
    } else if (key === "f") {
      const corners = values.map((word) => cornerOf(word, builder.vertexCount));
      ++face;
      builder.polygon(corners, () => `${name}, line ${number}, face ${face}`);
      for (const corner of corners) {
        least = Math.min(least, corner);
        most = Math.max(most, corner);
        areWhole &&= Number.isInteger(corner);
      }
    } else if (key !== undefined && Object.hasOwn(beside, key)) {
      builder.leftAside(beside[key]!);
    }
  }
  if (!(areWhole && least >= 0 && most < builder.vertexCount)) checkCorners(name, text, builder.vertexCount);
  return builder.finish(name);
}

/** Names a fault as the file counts: lines, faces and vertices from 1. A face may name vertices that come after it. */
function checkCorners(name: string, text: string, vertexCount: number): void {
  let [face, before] = [0, 0];
  for (const { words, number } of logicalLines(text)) {
    if (words[0] === "v") ++before;
    if (words[0] !== "f") continue;
    ++face;
    const wrong = words.slice(1).find((word) => {
      const corner = cornerOf(word, before);
      return !(Number.isInteger(corner) && corner >= 0 && corner < vertexCount);
    });
    if (wrong === undefined) continue;
    const limit = wrong.startsWith("-") ? `${before} vertices come before it` : `there are ${vertexCount} vertices`;
    throw new FileFault(`${name}, line ${number}: face ${face} has the corner “${wrong}”; ${limit}.`);
  }
}
