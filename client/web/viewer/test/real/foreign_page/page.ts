// Converts files without the viewer around it.
import { FileFault } from "lpdeform-client/mesh/fault";
import { glbOf } from "../../../src/io/foreign.js";
import { parseMesh } from "lpdeform-client/mesh/read";

declare global {
  interface Window {
    /** What became of the file: its vertices, or why it is refused. Throws what is no FileFault. */
    convert(name: string, bytes: readonly number[]): Promise<string>;
    /** The same for copies in which bytes were changed, cut off or doubled, from this seed on. How often which came. */
    mutate(name: string, bytes: readonly number[], seed: number, count: number): Promise<{ read: number; refused: number }>;
  }
}

async function converted(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<string> {
  try {
    const { glb } = await glbOf(new File([bytes], name));
    return `${parseMesh(glb.name, new Uint8Array(await glb.arrayBuffer())).positions.length / 3} vertices`;
  } catch (error) {
    if (error instanceof FileFault) return error.message;
    throw error;
  }
}

window.convert = (name, bytes) => converted(name, Uint8Array.from(bytes));

window.mutate = async (name, bytes, seed, count) => {
  let state = seed;
  const below = (most: number) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return Math.floor((state / 2 ** 32) * most);
  };
  const found = { read: 0, refused: 0 };
  for (let k = 0; k < count; ++k) {
    const changed = Uint8Array.from(bytes);
    for (let n = 1 + below(4); n > 0; --n) changed[below(changed.length)] = below(256);
    const begin = below(changed.length);
    const size = below(200);
    const way = below(4);
    if (way === 0) changed.copyWithin(below(changed.length), begin, begin + size);
    const whole = await converted(name, way === 1 ? changed.slice(0, begin) : changed);
    if (whole.endsWith(" vertices")) ++found.read;
    else ++found.refused;
  }
  return found;
};
