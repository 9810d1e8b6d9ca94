import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";

const beside = { ST: "texture coordinates", C: "colours of vertices", N: "normals" };

/** OFF and its variants with normals, colours and texture coordinates. Only positions and faces are read. */
export function readOff(name: string, text: string): Mesh {
  const lines = text
    .split(/\r?\n|\r/)
    .map((line, k) => ({ text: line.replace(/#.*/, "").trim(), number: k + 1 }))
    .filter((line) => line.text !== "");
  const header = /^((?:ST)?C?N?)OFF\b\s*(.*)$/.exec(lines[0]?.text ?? "");
  if (!header) throw new FileFault(`${name} does not begin with OFF.`);
  let next = 1;
  const counts = (header[2] || lines[next++]?.text || "").split(/\s+/).map(Number);
  const [vertexCount = NaN, faceCount = NaN] = counts;
  if (!(vertexCount >= 0 && faceCount >= 0))
    throw new FileFault(`${name} does not say how many vertices and faces it has.`);
  const builder = new MeshBuilder();
  for (const [letter, what] of Object.entries(beside)) if (header[1]!.includes(letter)) builder.leftAside(what);
  const line = (what: string) => {
    const found = lines[next++];
    if (!found) throw new FileFault(`${name} ends before ${what}.`);
    return { where: `${name}, line ${found.number}, ${what}`, numbers: found.text.split(/\s+/).map(Number) };
  };
  for (let v = 0; v < vertexCount; ++v) {
    const { numbers, where } = line(`vertex ${v}`);
    const [x = NaN, y = NaN, z = NaN] = numbers;
    builder.vertex(x, y, z, where);
  }
  const firstFace = next;
  for (let f = 0; f < faceCount; ++f) {
    const { numbers, where } = line(`face ${f}`);
    const [count = 0, ...corners] = numbers;
    if (corners.length < count) {
      throw new FileFault(`${where}: it says that it has ${count} corners, and names ${corners.length}.`);
    }
    builder.polygon(corners.slice(0, count), where);
    if (corners.length > count) builder.leftAside("colours of faces");
  }
  return builder.finish(name, (face) => `${name}, line ${lines[firstFace + face]!.number}: face ${face}`);
}
