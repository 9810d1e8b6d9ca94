// What a person did step by step, taken back and done again, and the session with its steps as a file.
//
//   node examples/steps.ts http://localhost:8080
import { openSession, restoreSession } from "lpdeform-client";

const url = process.argv[2]!;
const square = {
  vertices: new Float32Array([0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 1, 0]),
  faces: new Uint32Array([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]),
};

const session = await openSession(square, { url });
session.setHandles({ rim: { vertices: [0, 1, 2, 3] }, middle: { vertices: [4] } });
for (const height of [1, 2]) {
  session.update({ handles: { middle: { move: { translation: [0, 0, height] } } }, beginsStep: true });
  await session.settle({ timeoutMs: 10_000 });
}
await session.undo();
const file = await session.snapshot();
await session.close();

// On another day, and on another server.
const again = await restoreSession(file, { url });
console.log(`the middle is at height ${(await again.settle({ timeoutMs: 10_000 })).positions[14]}`);
await again.redo();
console.log(`and at height ${(await again.settle({ timeoutMs: 10_000 })).positions[14]} again`);
await again.close();
