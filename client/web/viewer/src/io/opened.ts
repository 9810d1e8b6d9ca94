import { type Derived, derivedOf, know } from "../model/derived.js";
import type { Mesh } from "../model/mesh.js";
import { Seams } from "../model/seams.js";
import { FileFault } from "./fault.js";
import { readMesh } from "./read.js";

/** What a worker is asked to do: to read a file, or to find what is derived of a mesh. */
export type Asked = { file: File; beside: readonly File[] } | { mesh: Mesh };
/** What it answers: the mesh, which it has read, and what is derived of it, without classes. Or why it cannot. */
export type Answer =
  | { mesh: Mesh | undefined; derived: Omit<Derived, "seams"> & { seams: Pick<Seams, "groups" | "faces"> | undefined } }
  | { fault: string }
  | { error: string };

/** Below this size the page is as quick by itself. */
const smallBytes = 200_000;

/**
 * Reads a mesh file and finds what is needed to show it; for a large one in a worker. `beside`: files that were opened with it.
 * Rejects with a FileFault.
 */
export async function openedMesh(file: File, beside: readonly File[]): Promise<Mesh> {
  const isLarge = [file, ...beside].some(({ size }) => size > smallBytes);
  const answer = isLarge ? await askWorker({ file, beside }) : undefined;
  if (answer?.mesh) {
    know(answer.mesh, withClasses(answer));
    return answer.mesh;
  }
  return meshOf(file, beside);
}

/** Reads a mesh file on this thread. */
export async function meshOf(file: File, beside: readonly File[]): Promise<Mesh> {
  const bytesOf = async (one: File) => new Uint8Array(await one.arrayBuffer());
  const others = await Promise.all(beside.map(async (one) => [one.name, await bytesOf(one)] as const));
  return readMesh(file.name, await bytesOf(file), new Map(others));
}

/** Finds what is needed to show a mesh; for a large one in a worker. */
export async function prepare(mesh: Mesh): Promise<void> {
  const isLarge = mesh.positions.byteLength + mesh.faces.byteLength > smallBytes;
  const answer = isLarge ? await askWorker({ mesh }) : undefined;
  if (answer) know(mesh, withClasses(answer));
  else derivedOf(mesh);
}

type Found = Extract<Answer, { derived: unknown }>;

function withClasses({ derived: { seams, ...derived } }: Found): Derived {
  return { ...derived, seams: seams && new Seams(seams.groups, seams.faces) };
}

/** Undefined if this page can have no worker. */
function askWorker(asked: Asked): Promise<Found | undefined> {
  let worker: Worker;
  try {
    worker = new Worker(new URL("./opening_worker.ts", import.meta.url), { type: "module" });
  } catch {
    return Promise.resolve(undefined);
  }
  return new Promise<Found | undefined>((resolve, reject) => {
    worker.onerror = () => resolve(undefined);
    worker.onmessage = ({ data }: MessageEvent<Answer>) => {
      if ("fault" in data) reject(new FileFault(data.fault));
      else if ("error" in data) reject(new Error(data.error));
      else resolve(data);
    };
    worker.postMessage(asked);
  }).finally(() => worker.terminate());
}
