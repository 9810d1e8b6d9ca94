// One finished result, with how it came about and how far it can be from the optimum for its rotations.
//
//   node examples/solve.ts http://localhost:8080
import { openSession } from "lpdeform-client";

const tetrahedron = {
  vertices: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1],
  faces: [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3],
};

const session = await openSession(tetrahedron, { url: process.argv[2]!, settings: { p: 1 } });
session.setHandles({
  base: { vertices: [0, 1] },
  top: { vertices: [3], motion: { targets: [0, 0, 3] }, hold: { kind: "soft", weight: 100 } },
});
const result = await session.solve({
  certify: true,
  trace: true,
  deadlineMs: 10_000,
  onProgress: ({ iteration, energy }) => console.error(`iteration ${iteration}: E = ${energy}`),
});
console.log(`${result.stopReason} after ${result.trace.at(-1)!.iteration} iterations of ${result.method}`);
console.log(`within ${(100 * result.optimalityGap!).toPrecision(2)} % of the optimum for its rotations`);
// Another minimum may be lower. This mesh is not searched: it has fewer than 100 vertices.
const seen = result.minima.map((energy) => energy.toPrecision(3)).join(", ");
console.log(
  `looked for lower minima from ${result.furtherStarts} further starts; minima were seen at E = ${seen || "?"}`,
);
await session.close();
