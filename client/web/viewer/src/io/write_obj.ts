import { polygonsOf, type WrittenMesh } from "lpdeform-client/mesh/mesh";

export function writeObj({ positions, faces, corners }: WrittenMesh): string {
  const lines: string[] = [];
  for (let k = 0; k < positions.length; k += 3) lines.push(`v ${positions[k]} ${positions[k + 1]} ${positions[k + 2]}`);
  for (const polygon of polygonsOf({ faces, ...(corners && { corners }) })) {
    lines.push(`f ${polygon.map((vertex) => vertex + 1).join(" ")}`);
  }
  return `${lines.join("\n")}\n`;
}
