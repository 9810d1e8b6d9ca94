// The mesh and the end of the quick start of client/web/README.md: ten squares in a row.
const vertices = new Float32Array(Array.from({ length: 22 }, (_, i) => [Math.floor(i / 2), i % 2, 0]).flat());
const faces = Array.from({ length: 60 }, (_, k) => 2 * Math.floor(k / 6) + [0, 2, 3, 0, 3, 1][k % 6]!);
const base = [0, 1],
  tip = [20, 21];
QUICK_START;
console.log(frame.positions[3 * 20 + 2]);
await session.close();
