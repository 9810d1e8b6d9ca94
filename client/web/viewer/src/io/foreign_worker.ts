import "./worker_dom.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { type Converted, glbIn } from "./foreign_glb.js";
import { unpackedZipBytes } from "./unpacked.js";

// Reads files for foreign.ts.

/** The converted file, why it is refused, or that the page has to read it. */
export type Reply = Converted | { fault: string } | { isForPage: true };

/** Of a 3MF file unpacked: its XML takes about 26 times as much here. */
const mostBytes = 32e6;

const scope = globalThis as unknown as {
  postMessage(reply: Reply, transfer?: ArrayBuffer[]): void;
  onmessage: (event: MessageEvent<File>) => void;
};

scope.onmessage = async ({ data: file }) => {
  try {
    if (await isTooLarge(file)) return scope.postMessage({ isForPage: true });
    const converted = await glbIn(file);
    scope.postMessage(converted, [converted.glb]);
  } catch (thrown) {
    scope.postMessage(thrown instanceof FileFault ? { fault: thrown.message } : { isForPage: true });
  }
};

async function isTooLarge(file: File): Promise<boolean> {
  if (!/\.3mf$/i.test(file.name)) return false;
  const bytes = await unpackedZipBytes(new Uint8Array(await file.arrayBuffer())).catch(() => 0); // what it is not is said later
  return bytes > mostBytes;
}
