import { openSession } from "lpdeform-client";

// A square of four triangles whose middle is lifted.
const mesh = {
  vertices: new Float32Array([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 0]),
  faces: new Uint32Array([0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4]),
};
const app = document.querySelector<HTMLElement>("#app")!;
const session = await openSession(mesh, { settings: { p: 1.5 } });
session.setHandles({ rim: { vertices: [0, 1, 3] }, middle: { vertices: [4], motion: { translation: [0, 0, 0.5] } } });
for await (const frame of session) {
  app.textContent = `${frame.positions.length / 3} vertices, energy ${frame.energy}, converged ${frame.converged}`;
}
