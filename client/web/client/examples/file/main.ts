// A file of the user: a worker reads it, and finds normals of every frame; three.js draws it, and a slider shifts its upper end.
//
//   npx vite examples/file        and the page http://localhost:5173/?url=http://localhost:8080
import * as THREE from "three";
import { openSession, type Session } from "lpdeform-client";
import { type OpenMesh, readMesh } from "lpdeform-client/mesh";

const url = new URLSearchParams(location.search).get("url") ?? "http://localhost:8080";
const [file, shift] = document.querySelectorAll("input") as unknown as [HTMLInputElement, HTMLInputElement];
const text = document.querySelector("output")!;
const geometry = new THREE.BufferGeometry();
let session: Session | undefined;
let opened: OpenMesh | undefined;

file.onchange = async () => {
  const chosen = file.files![0];
  if (!chosen) return;
  file.disabled = true; // one file at a time
  try {
    await close();
    await open(chosen);
  } catch (error) {
    text.value = (error as Error).message; // which line or element is wrong
    await close();
  }
  file.disabled = false;
};

/** Ends the session, and then the worker that reads its frames. */
async function close(): Promise<void> {
  await session?.close().catch(() => undefined); // it expires by itself if the server is away
  opened?.close();
  session = opened = undefined;
  surface.visible = false;
}

async function open(chosen: File): Promise<void> {
  opened = await readMesh(chosen);
  const { positions } = opened.mesh;
  const { bounds, shown } = opened.derived;
  session = await openSession(opened.sessionMesh, { url, weld: opened.weld, shading: opened });
  const where = (isIn: (height: number) => boolean) =>
    [...Array(positions.length / 3).keys()].filter((vertex) => isIn(positions[3 * vertex + 1]!));
  const [low, high] = [bounds.min[1], bounds.max[1]];
  const tenth = (high - low) / 10;
  session.setHandles({
    base: { vertices: where((y) => y < low + tenth) },
    tip: { vertices: where((y) => y > high - tenth) },
  });
  shift.oninput = () => session?.move("tip", { translation: [shift.valueAsNumber * bounds.diagonal, 0, 0] });

  const attribute = (array: Float32Array) => new THREE.BufferAttribute(array, 3).setUsage(THREE.DynamicDrawUsage);
  geometry.setIndex(new THREE.BufferAttribute(shown.drawn.indices, 1));
  geometry.setAttribute("position", attribute(shown.atRest.positions));
  geometry.setAttribute("normal", attribute(shown.atRest.normals));
  surface.visible = true;
  camera.position.set(bounds.center[0], bounds.center[1], bounds.center[2] + 2 * bounds.diagonal);
  text.value = `${positions.length / 3} vertices.`;
}

const scene = new THREE.Scene();
scene.background = new THREE.Color("white");
scene.add(new THREE.HemisphereLight("white", "gray", 3));
const surface = new THREE.Mesh(
  geometry,
  new THREE.MeshStandardMaterial({ color: "steelblue", side: THREE.DoubleSide }),
);
surface.frustumCulled = false; // its bounds change with every frame
surface.visible = false;
scene.add(surface);
const camera = new THREE.PerspectiveCamera(45, innerWidth / innerHeight, 0.01, 1000);
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);

renderer.setAnimationLoop(() => {
  const shaded = session?.poll()?.shaded;
  if (shaded) {
    for (const name of ["position", "normal"] as const) {
      const attribute = geometry.attributes[name] as THREE.BufferAttribute;
      attribute.array = name === "position" ? shaded.positions : shaded.normals;
      attribute.needsUpdate = true;
    }
  }
  renderer.render(scene, camera);
});
