// A live drag: handles move as fast as the pointer does, frames are shown as fast as they come, and neither waits for the other.
//
//   node examples/drag.ts http://localhost:8080
import { openSession } from "lpdeform-client";

// A strip of ten squares.
const vertices = new Float32Array(22 * 3);
const faces = [];
for (let k = 0; k <= 10; ++k) {
  vertices.set([k, 0, 0, k, 1, 0], 6 * k);
  if (k < 10) faces.push(2 * k, 2 * k + 2, 2 * k + 1, 2 * k + 2, 2 * k + 3, 2 * k + 1);
}

const session = await openSession({ vertices, faces }, { url: process.argv[2]!, maxFramesPerSecond: 60 });
session.on("problem", (error) => console.error(error.message));
session.setHandles({ start: { vertices: [0, 1] }, end: { vertices: [20, 21] } });

let last = 0;
let pointer = 0;
const moving = setInterval(() => {
  pointer += 1;
  last = session.move("end", {
    axis: [0, 1, 0],
    angle: pointer / 50,
    center: [10, 0, 0],
    translation: [0, 0, pointer / 50],
  });
  if (pointer === 100) clearInterval(moving);
}, 5);

for await (const frame of session) {
  // Here a page gives frame.positions to the GPU. Taking the next frame tells the server that this one was shown.
  if (pointer === 100 && frame.isFinal && frame.inputSeq >= last) {
    console.log(`the end is at height ${frame.positions[3 * 20 + 2]!.toFixed(3)}`);
    break;
  }
}
await session.close();
