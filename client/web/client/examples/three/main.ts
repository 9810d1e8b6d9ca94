// three.js: a cylinder that bends where the ball at its upper end is dragged.
//
//   npx vite examples/three        and the page http://localhost:5173/?url=http://localhost:8080
import * as THREE from "three";
import { openSession } from "lpdeform-client";

const url = new URLSearchParams(location.search).get("url") ?? "http://localhost:8080";
const text = document.querySelector("output")!;

// Vertices that three.js splits along seams and hard edges are welded on the server, and keep their own normals.
const geometry = new THREE.CylinderGeometry(0.3, 0.3, 3, 32, 40);
const { position, normal } = geometry.attributes as { position: THREE.BufferAttribute; normal: THREE.BufferAttribute };
const mesh = {
  vertices: Float32Array.from(position.array),
  faces: Uint32Array.from(geometry.index!.array),
  normals: Float32Array.from(normal.array),
};
const heights = Array.from({ length: position.count }, (_, vertex) => position.getY(vertex));
const where = (isIn: (height: number) => boolean) => [...heights.keys()].filter((vertex) => isIn(heights[vertex]!));

const session = await openSession(mesh, { url, weld: "byPosition", withNormals: true });
session.on("problem", ({ message }) => (text.value = message));
session.setHandles({ base: { vertices: where((y) => y < -1.4) }, tip: { vertices: where((y) => y > 1.4) } });

const scene = new THREE.Scene();
scene.background = new THREE.Color("white");
scene.add(new THREE.HemisphereLight("white", "gray", 3));
scene.add(new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color: "steelblue" })));
const ball = new THREE.Mesh(new THREE.SphereGeometry(0.2), new THREE.MeshStandardMaterial({ color: "orange" }));
ball.position.y = 1.8;
scene.add(ball);
const camera = new THREE.PerspectiveCamera(45, innerWidth / innerHeight);
camera.position.z = 6;
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);

/** Where the pointer is in the plane of the cylinder's axis that faces the camera. */
function pointed({ clientX, clientY }: PointerEvent): THREE.Raycaster {
  const ray = new THREE.Raycaster();
  ray.setFromCamera(new THREE.Vector2((2 * clientX) / innerWidth - 1, 1 - (2 * clientY) / innerHeight), camera);
  return ray;
}
const plane = new THREE.Plane(new THREE.Vector3(0, 0, 1));
const canvas = renderer.domElement;
canvas.onpointerdown = (event) => {
  if (pointed(event).intersectObject(ball).length > 0) canvas.setPointerCapture(event.pointerId);
};
canvas.onpointermove = (event) => {
  if (!canvas.hasPointerCapture(event.pointerId)) return;
  pointed(event).ray.intersectPlane(plane, ball.position);
  session.move("tip", { translation: [ball.position.x, ball.position.y - 1.8, 0] }); // waits for nothing
};

renderer.setAnimationLoop(() => {
  const frame = session.poll(); // the newest one, or nothing
  if (frame) {
    position.copyArray(frame.positions).needsUpdate = true;
    normal.copyArray(frame.normals).needsUpdate = true;
    geometry.computeBoundingSphere();
    if (frame.isFinal) text.value = `Energy ${frame.energy.toPrecision(3)}`;
  }
  renderer.render(scene, camera);
});
