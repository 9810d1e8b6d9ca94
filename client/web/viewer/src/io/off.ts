import { polygonsOf, type Mesh, type WrittenMesh } from "../model/mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";

const beside = { ST: "texture coordinates", C: "colours of vertices", N: "normals" };

/** OFF and its variants with normals, colours and texture coordinates. Only positions and faces are read. */
export function readOff(name: string, text: string): Mesh {
  const lines = text
    .split(/\r?\n|\r/)
    .map((line) => line.replace(/#.*/, "").trim())
    .filter((line) => line !== "");
  const header = /^((?:ST)?C?N?)OFF\b\s*(.*)$/.exec(lines[0] ?? "");
  if (!header) throw new FileFault(`${name} does not begin with OFF.`);
  let next = 1;
  const counts = (header[2] || lines[next++] || "").split(/\s+/).map(Number);
  const [vertexCount = NaN, faceCount = NaN] = counts;
  if (!(vertexCount >= 0 && faceCount >= 0)) throw new FileFault(`${name} does not say how many vertices and faces it has.`);
  const builder = new MeshBuilder();
  for (const [letter, what] of Object.entries(beside)) if (header[1]!.includes(letter)) builder.leftAside(what);
  const line = (what: string) => {
    const words = lines[next++];
    if (words === undefined) throw new FileFault(`${name} ends before ${what}.`);
    return words.split(/\s+/).map(Number);
  };
  for (let v = 0; v < vertexCount; ++v) {
    const [x = NaN, y = NaN, z = NaN] = line(`vertex ${v}`);
    builder.vertex(x, y, z, `${name}, vertex ${v}`);
  }
  for (let f = 0; f < faceCount; ++f) {
    const [count = 0, ...corners] = line(`face ${f}`);
    if (corners.length < count) {
      throw new FileFault(`${name}, face ${f}: it says that it has ${count} corners, and names ${corners.length}.`);
    }
    builder.polygon(corners.slice(0, count), `${name}, face ${f}`);
    if (corners.length > count) builder.leftAside("colours of faces");
  }
  return builder.finish(name);
}

export function writeOff({ positions, faces, corners }: WrittenMesh): string {
  const lines = ["OFF", `${positions.length / 3} ${corners?.length ?? faces.length / 3} 0`];
  for (let k = 0; k < positions.length; k += 3) lines.push(`${positions[k]} ${positions[k + 1]} ${positions[k + 2]}`);
  for (const polygon of polygonsOf({ faces, ...(corners && { corners }) }))
    lines.push(`${polygon.length} ${polygon.join(" ")}`);
  return `${lines.join("\n")}\n`;
}
