// Compressed files that claim little and unpack to more than a page can hold are refused before the readers of three.js unpack them.

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
  unzipSync(bytes, { filter: measure });
  return size;
}

const widths: Record<string, number> = { C: 1, Y: 2, I: 4, F: 4, D: 8, L: 8 };
const elementWidths: Record<string, number> = { b: 1, c: 1, i: 4, f: 4, d: 8, l: 8 };
/** The magic of an FBX file, before its version. */
const headBytes = 23;
/** What follows the last node. */
const footBytes = 176;

/** Of the arrays in a binary FBX file: each number of them takes eight bytes in the reader of three.js. */
export async function checkUnpackedFbx(bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  if (!new TextDecoder().decode(bytes.subarray(0, headBytes)).startsWith("Kaydara FBX Binary")) return;
  const view = new DataView(bytes.buffer);
  const number = (at: number) => view.getUint32(at, true);
  const isLong = number(headBytes) >= 7500;
  const field = (at: number) => (isLong ? Number(view.getBigUint64(at, true)) : number(at));
  const fieldBytes = isLong ? 8 : 4;
  let size = 0;
  // Each node is its end, the count and the bytes of its properties, its name, and the properties. Its children follow.
  for (let at = headBytes + 4; at + footBytes < bytes.length;) {
    const count = field(at) === 0 ? 0 : field(at + fieldBytes);
    const name = at + 3 * fieldBytes;
    at = name + 1 + view.getUint8(name);
    for (let k = 0; k < count; ++k) {
      const type = String.fromCharCode(view.getUint8(at++));
      const width = elementWidths[type];
      if (!width) {
        at += widths[type] ?? 4 + number(at);
        continue;
      }
      const [length, isPacked, packedBytes] = [number(at), number(at + 4) !== 0, number(at + 8)];
      at += 12;
      const end = at + (isPacked ? packedBytes : length * width);
      if (isPacked) size += (8 / width) * (await unpackedBytes(bytes.subarray(at, end), ((mostBytes - size) * width) / 8));
      check(size);
      at = end;
    }
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
