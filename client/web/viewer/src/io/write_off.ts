import { polygonsOf, type WrittenMesh } from "lpdeform-client/mesh/mesh";

export function writeOff({ positions, faces, corners }: WrittenMesh): string {
  const lines = ["OFF", `${positions.length / 3} ${corners?.length ?? faces.length / 3} 0`];
  for (let k = 0; k < positions.length; k += 3) lines.push(`${positions[k]} ${positions[k + 1]} ${positions[k + 2]}`);
  for (const polygon of polygonsOf({ faces, ...(corners && { corners }) }))
    lines.push(`${polygon.length} ${polygon.join(" ")}`);
  return `${lines.join("\n")}\n`;
}
