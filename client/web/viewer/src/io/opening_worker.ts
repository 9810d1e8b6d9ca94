import { derive } from "../model/derived.js";
import { FileFault } from "./fault.js";
import { type Answer, type Asked, meshOf } from "./opened.js";

// A worker that reads one file, or finds what is derived of one mesh, and ends.
const scope = globalThis as unknown as Pick<Worker, "postMessage"> & { onmessage: (event: MessageEvent<Asked>) => void };

scope.onmessage = ({ data }) =>
  void answer(data).then(
    (found) => scope.postMessage(found, buffersIn(found)),
    (error: unknown) =>
      scope.postMessage(error instanceof FileFault ? { fault: error.message } : { error: (error as Error).message }),
  );

async function answer(asked: Asked): Promise<Answer> {
  const mesh = "mesh" in asked ? asked.mesh : await meshOf(asked.file, asked.beside);
  const { seams, ...derived } = derive(mesh);
  return {
    mesh: "mesh" in asked ? undefined : mesh,
    derived: { ...derived, seams: seams && { groups: seams.groups, faces: seams.faces } },
  };
}

/** The memory of all arrays in a value, each once. */
function buffersIn(value: unknown, found = new Set<ArrayBuffer>()): ArrayBuffer[] {
  if (ArrayBuffer.isView(value)) found.add(value.buffer as ArrayBuffer);
  else if (value && typeof value === "object") for (const part of Object.values(value)) buffersIn(part, found);
  return [...found];
}
