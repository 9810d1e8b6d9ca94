// Compressed files that claim little and unpack to more than a page can hold are refused before the readers of three.js unpack them.

import { fbxNodes, isBinaryFbx } from "./fbx_nodes.js";

/** What is more than that, unpacked, is nothing that a page can show. */
const mostBytes = 500e6;

function check(size: number): void {
  if (size > mostBytes) throw new Error(`unpacked it has ${size} bytes or more, and this page takes ${mostBytes}`);
}

export async function checkUnpackedZip(bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  check(await unpackedZipBytes(bytes));
}

/** As it claims: the reader of three.js gives each part of a ZIP file that room, and no more. */
export async function unpackedZipBytes(bytes: Uint8Array<ArrayBuffer>): Promise<number> {
  const { unzipSync } = await import("three/addons/libs/fflate.module.js");
  let size = 0;
  const measure = ({ originalSize }: { originalSize: number }) => {
    size += originalSize;
    return false;
  };
  try {
    unzipSync(bytes, { filter: measure });
  } catch {
    throw new Error("the end of a ZIP file, where its parts are listed, is missing or damaged");
  }
  return size;
}

/** Of the arrays in a binary FBX file: each number of them takes eight bytes in the reader of three.js. */
export async function checkUnpackedFbx(bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  if (!isBinaryFbx(bytes)) return;
  let size = 0;
  try {
    for (const { properties } of fbxNodes(bytes)) {
      for (const { begin, end, width, isPacked } of properties) {
        if (!isPacked) continue;
        size += (8 / width) * (await unpackedBytes(bytes.subarray(begin, end), ((mostBytes - size) * width) / 8));
        check(size);
      }
    }
  } catch (error) {
    if (!(error instanceof RangeError)) throw error; // it ends too soon: checkFbx() says where
  }
}

/** Stops counting above `most`. Damaged data count as far as they can be unpacked. */
async function unpackedBytes(packed: Uint8Array<ArrayBuffer>, most: number): Promise<number> {
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  let size = 0;
  try {
    while (size <= most) {
      const { done, value } = await reader.read();
      if (done) break;
      size += value.length;
    }
    await reader.cancel();
  } catch {
    // The reader of three.js tells what is wrong.
  }
  return size;
}
