import type { FrameShading } from "lpdeform-client";
import { FileFault, OpenMesh, type Welding } from "lpdeform-client/mesh";
import { derivedOf, isKnown, usualWelding } from "lpdeform-client/mesh/derived";
import type { PullRequest, Source } from "lpdeform-client/mesh/desk";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { readable } from "lpdeform-client/mesh/read";
import type { StoredMesh } from "lpdeform-client/mesh/stored";

/** From this number of vertices on, a page is busy for more than some milliseconds with a frame. */
const largeVertices = 20_000;

/** The workers of meshes; the page has one for the mesh that it shows, and for one that is about to be shown. */
const all = new Map<Mesh, Promise<OpenMesh>>();

/** What a page wants of a mesh's worker. */
export interface MeshWorker extends FrameShading {
  pull(request: PullRequest): Promise<Float32Array>;
}

/** Reads a mesh file. `beside`: files that were opened with it. Rejects with a FileFault. */
export async function openedMesh(file: File, beside: readonly File[]): Promise<Mesh> {
  if (!readable.test(file.name)) {
    throw new FileFault(`${file.name} is not a mesh that can be read: GLB, glTF, OFF, OBJ, PLY, STL, FBX, DAE and 3MF can.`);
  }
  return meshFrom({ file, beside });
}

/** The mesh that was stored. Rejects if the browser no longer has it. */
export function openedStored(stored: StoredMesh, welding: Welding): Promise<Mesh> {
  return meshFrom({ stored }, welding);
}

async function meshFrom(source: Source, welding = usualWelding): Promise<Mesh> {
  const one = await OpenMesh.from(source, welding);
  all.set(one.mesh, Promise.resolve(one));
  return one.mesh;
}

/** Finds what is needed to show a mesh. */
export async function prepare(mesh: Mesh, welding: Welding): Promise<void> {
  if (isKnown(mesh, welding)) return;
  const one = await openOf(mesh, welding);
  if (!isKnown(mesh, welding)) await one.reweld(welding);
}

/** Takes the frames of a large mesh; undefined if the page takes them itself. */
export function workerOf(mesh: Mesh): MeshWorker | undefined {
  if (mesh.positions.length < 3 * largeVertices) return undefined;
  const one = openOf(mesh, derivedOf(mesh).welding);
  return {
    unpack: async (packed) => (await one).unpack(packed),
    shade: async (surface) => (await one).shade(surface),
    pull: async (request) => (await one).pull(request),
  };
}

/** For the browser's database, without copying a large mesh. */
export async function storedOf(mesh: Mesh): Promise<Mesh | StoredMesh> {
  const one = await all.get(mesh);
  if (!one?.isInWorker) return mesh;
  return one.store().catch(() => mesh); // the worker has just ended
}

/** Ends the workers of all other meshes. */
export function keepOnly(mesh: Mesh): void {
  for (const [other, one] of all) {
    if (other === mesh) continue;
    all.delete(other);
    one.then((it) => it.close()).catch(() => undefined); // it could not be opened
  }
}

function openOf(mesh: Mesh, welding: Welding): Promise<OpenMesh> {
  const known = all.get(mesh);
  if (known) return known;
  const one = OpenMesh.from({ mesh }, welding);
  all.set(mesh, one);
  one.catch(() => all.get(mesh) === one && all.delete(mesh)); // the next question tries again
  return one;
}
