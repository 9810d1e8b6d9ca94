// The first steps: a square of four triangles, its rim held, its middle lifted.
//
//   node examples/first.ts http://localhost:8080
import { openSession } from "lpdeform-client";

const square = {
  vertices: new Float32Array([0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 1, 0]),
  faces: new Uint32Array([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]),
};

const session = await openSession(square, { url: process.argv[2]!, settings: { p: 1.5 } });
session.setHandles({
  rim: { vertices: [0, 1, 2, 3] },
  middle: { vertices: [4], motion: { translation: [0, 0, 1] } },
});
const frame = await session.settle({ timeoutMs: 10_000 });
console.log(`${frame.positions.length / 3} vertices, the middle at height ${frame.positions[14]}`);
await session.close();
