import { polygonsOf, type Mesh, type WrittenMesh } from "../model/mesh.js";
import { MeshBuilder } from "./builder.js";
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
  for (const { words, number } of logicalLines(text)) {
    const [key, ...values] = words;
    if (key === "v") {
      const [x = NaN, y = NaN, z = NaN] = values.map(Number);
      builder.vertex(x, y, z, `${name}, line ${number}`);
      if (values.length > 5) builder.leftAside("colours of vertices");
    } else if (key === "f") {
      const corners = values.map((word) => cornerOf(word, builder.vertexCount));
      builder.polygon(corners, `${name}, line ${number}`);
    } else if (key !== undefined && Object.hasOwn(beside, key)) {
      builder.leftAside(beside[key]!);
    }
  }
  return builder.finish(name);
}

export function writeObj({ positions, faces, corners }: WrittenMesh): string {
  const lines: string[] = [];
  for (let k = 0; k < positions.length; k += 3) lines.push(`v ${positions[k]} ${positions[k + 1]} ${positions[k + 2]}`);
  for (const polygon of polygonsOf({ faces, ...(corners && { corners }) })) {
    lines.push(`f ${polygon.map((vertex) => vertex + 1).join(" ")}`);
  }
  return `${lines.join("\n")}\n`;
}
