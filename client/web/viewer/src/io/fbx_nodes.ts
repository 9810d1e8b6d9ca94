// The nodes of a binary FBX file, one after the other.

const widths: Record<string, number> = { C: 1, Y: 2, I: 4, F: 4, D: 8, L: 8 };
const elementWidths: Record<string, number> = { b: 1, c: 1, i: 4, f: 4, d: 8, l: 8 };
/** The magic of an FBX file, before its version. */
const headBytes = 23;
/** What the reader of three.js takes to follow the last node of the file, at the most; it is filled up to a multiple of 16 bytes. */
const footBytes = 176;
/** Of those that are no arrays, more say nothing here. */
const mostProperties = 16;

export interface FbxProperty {
  /** Its letter in the file; small ones are arrays. */
  type: string;
  /** Of its value: where it begins and ends, packed if so. */
  begin: number;
  end: number;
  /** Of an array: how many items it claims, how wide each is, and whether they are packed. */
  length: number;
  width: number;
  isPacked: boolean;
}

export interface FbxNode {
  name: string;
  at: number;
  /** Where it says that it ends, with all that stand in it. */
  end: number;
  /** The first ones, and all arrays. */
  properties: FbxProperty[];
}

export const isBinaryFbx = (bytes: Uint8Array): boolean =>
  new TextDecoder().decode(bytes.subarray(0, headBytes)).startsWith("Kaydara FBX Binary");

export const versionOf = (bytes: Uint8Array): number =>
  new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength).getUint32(headBytes, true);

/** Whether the reader of three.js takes what is there for the foot of the file. */
function isFoot(at: number, size: number): boolean {
  const end = at + footBytes;
  return (size % 16 === 0 ? end - (end % 16) : end) >= size;
}

/** Throws a RangeError where the file ends too soon. */
export function* fbxNodes(bytes: Uint8Array<ArrayBuffer>): Generator<FbxNode> {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const number = (at: number) => view.getUint32(at, true);
  const isLong = versionOf(bytes) >= 7500;
  const field = (at: number) => (isLong ? Number(view.getBigUint64(at, true)) : number(at));
  const fieldBytes = isLong ? 8 : 4;
  // Each node is its end, the count and the bytes of its properties, its name, and the properties. Its children follow.
  let outerEnd = 0; // of the outermost node
  for (let at = headBytes + 4; at < outerEnd || !isFoot(at, bytes.length);) {
    const [begin, end] = [at, field(at)];
    if (begin >= outerEnd) outerEnd = end;
    const count = end === 0 ? 0 : field(at + fieldBytes);
    const nameAt = at + 3 * fieldBytes + 1;
    at = nameAt + view.getUint8(nameAt - 1);
    const name = new TextDecoder().decode(bytes.subarray(nameAt, at));
    const properties: FbxProperty[] = [];
    for (let k = 0; k < count; ++k) {
      const type = String.fromCharCode(view.getUint8(at++));
      const width = elementWidths[type];
      if (width) {
        const [length, isPacked, packedBytes] = [number(at), number(at + 4) !== 0, number(at + 8)];
        const begin = at + 12;
        at = begin + (isPacked ? packedBytes : length * width);
        properties.push({ type, begin, end: at, length, width, isPacked });
      } else {
        const begin = at + (widths[type] ? 0 : 4);
        at = begin + (widths[type] ?? number(at));
        if (properties.length >= mostProperties) continue;
        properties.push({ type, begin, end: at, length: 1, width: at - begin, isPacked: false });
      }
    }
    if (end > 0) yield { name, at: begin, end, properties };
  }
}
