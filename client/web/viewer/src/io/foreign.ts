import { FileFault } from "lpdeform-client/mesh/fault";
import type { Converted } from "./foreign_glb.js";
import type { Reply } from "./foreign_worker.js";

/**
 * An FBX, COLLADA or 3MF file as a GLB, and what it had that is left out, in words; see foreign_glb.ts. A worker reads it, and where
 * there can be none the page. Rejects with a FileFault.
 */
export async function glbOf(file: File): Promise<{ glb: File; left: readonly string[] }> {
  const { glb, left } = (await byWorker(file)) ?? (await (await import("./foreign_glb.js")).glbIn(file));
  return { glb: new File([glb], file.name.replace(/\.[^.]*$/, ".glb")), left };
}

/** Undefined if the page has to read the file itself. */
function byWorker(file: File): Promise<Converted | undefined> {
  return new Promise((resolve, reject) => {
    const worker = startWorker();
    if (!worker) return resolve(undefined);
    const end = (settle: () => void) => {
      worker.terminate();
      settle();
    };
    worker.onmessage = ({ data }: MessageEvent<Reply>) =>
      end(() => ("fault" in data ? reject(new FileFault(data.fault)) : resolve("glb" in data ? data : undefined)));
    worker.onerror = worker.onmessageerror = () => end(() => resolve(undefined));
    worker.postMessage(file);
  });
}

function startWorker(): Worker | undefined {
  try {
    return new Worker(new URL("./foreign_worker.ts", import.meta.url), { type: "module" });
  } catch {
    return undefined;
  }
}
