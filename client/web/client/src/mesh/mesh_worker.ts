import { unforeseen } from "../errors.js";
import { Desk } from "./desk.js";
import { FileFault } from "./fault.js";
import type { Answer, Question, ToldError } from "./open_mesh.js";

// The worker of an OpenMesh: answers in the order in which it is asked.
const scope = globalThis as unknown as {
  postMessage(answer: Answer, transfer: ArrayBufferLike[]): void;
  onmessage: (event: MessageEvent<Question>) => void;
};
const desk = new Desk();
let before = Promise.resolve();

scope.onmessage = ({ data }) => (before = before.then(() => reply(data)));

async function reply({ id, name, asked }: Question): Promise<void> {
  try {
    const answer = await desk.answer(name, asked);
    // What is only drawn or unpacked is handed over. What is known of the mesh stays here, too, so the page gets a copy.
    const isKept = name === "open" || name === "weld" || name === "store";
    const given = isKept ? copied(answer) : answer;
    scope.postMessage({ id, answer: given }, buffersIn(given));
  } catch (thrown) {
    const isFault = thrown instanceof FileFault;
    scope.postMessage(isFault ? { id, fault: thrown.message } : { id, error: told(thrown) }, []);
  }
}

function told(thrown: unknown): ToldError {
  const { code, message, reason, element, limit } = unforeseen(thrown);
  return { code, message, reason, element, limit };
}

/** With new arrays, which leaves the copying to this thread: what is not handed over is copied by both. */
function copied(value: unknown): unknown {
  if (ArrayBuffer.isView(value)) return (value as Uint8Array).slice();
  if (value === null || typeof value !== "object" || value instanceof Blob) return value;
  if (Array.isArray(value)) return value;
  return Object.fromEntries(Object.entries(value).map(([key, part]) => [key, copied(part)]));
}

/** The memory of all arrays in a value, each once. */
function buffersIn(value: unknown, found = new Set<ArrayBufferLike>()): ArrayBufferLike[] {
  if (ArrayBuffer.isView(value)) found.add(value.buffer);
  else if (value !== null && typeof value === "object" && !(value instanceof Blob)) {
    for (const part of Object.values(value)) buffersIn(part, found);
  }
  return [...found];
}
