import { describe, expect, it } from "vitest";
import { type Detail, shapeKinds } from "../src/model/shapes.js";

const details: readonly Detail[] = ["coarse", "medium", "fine"];

/** How often each directed edge occurs. */
function edgeCounts(faces: Uint32Array): Map<string, number> {
  const counts = new Map<string, number>();
  for (let f = 0; f < faces.length; f += 3) {
    for (let corner = 0; corner < 3; ++corner) {
      const edge = `${faces[f + corner]} ${faces[f + ((corner + 1) % 3)]}`;
      counts.set(edge, (counts.get(edge) ?? 0) + 1);
    }
  }
  return counts;
}

function volume(positions: Float32Array, faces: Uint32Array): number {
  let sum = 0;
  for (let f = 0; f < faces.length; f += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => positions.subarray(3 * faces[f + k]!, 3 * faces[f + k]! + 3)) as Float32Array[];
    sum +=
      a![0]! * (b![1]! * c![2]! - b![2]! * c![1]!) +
      a![1]! * (b![2]! * c![0]! - b![0]! * c![2]!) +
      a![2]! * (b![0]! * c![1]! - b![1]! * c![0]!);
  }
  return sum / 6;
}

describe.each(shapeKinds)("$title", ({ make }) => {
  it.each(details)("is closed, manifold along its edges and oriented outwards (%s)", (detail) => {
    const { mesh } = make(detail);
    const counts = edgeCounts(mesh.faces);
    const isWrong = ([edge, count]: [string, number]) => count !== 1 || counts.get(edge.split(" ").reverse().join(" ")) !== 1;
    expect([...counts].filter(isWrong)).toEqual([]);
    expect(volume(mesh.positions, mesh.faces)).toBeGreaterThan(0);
  });

  it("has some thousand vertices, about ten thousand when fine", () => {
    const counts = details.map((detail) => make(detail).mesh.positions.length / 3);
    expect(counts[0]).toBeGreaterThan(300);
    expect(counts[2]).toBeGreaterThan(7000);
    expect(counts[2]).toBeLessThan(14_000);
    expect(counts).toEqual([...counts].sort((a, b) => a - b));
  });

  it("begins with handles that hold at least three vertices each", () => {
    const { document, first } = make("coarse");
    for (const handle of document.handles) expect(handle.vertices.length).toBeGreaterThanOrEqual(3);
    expect(document.handles.map(({ name }) => name)).toContain(first);
  });
});
