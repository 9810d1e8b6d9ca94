import { inTaskOfItsOwn, stepBytes } from "./task.js";

/** The remainders of each byte followed by 0 to 7 zero bytes, so that eight bytes are taken at once. */
const tables = Array.from({ length: 8 }, () => new Uint32Array(256));
for (let byte = 0; byte < 256; ++byte) {
  let rest = byte;
  for (let bit = 0; bit < 8; ++bit) rest = rest & 1 ? (rest >>> 1) ^ 0x82f63b78 : rest >>> 1;
  tables[0]![byte] = rest;
}
for (let zeros = 1; zeros < 8; ++zeros) {
  for (let byte = 0; byte < 256; ++byte) {
    const before = tables[zeros - 1]![byte]!;
    tables[zeros]![byte] = tables[0]![before & 0xff]! ^ (before >>> 8);
  }
}
const [t0, t1, t2, t3, t4, t5, t6, t7] = tables as [
  Uint32Array,
  Uint32Array,
  Uint32Array,
  Uint32Array,
  Uint32Array,
  Uint32Array,
  Uint32Array,
  Uint32Array,
];

/** CRC-32C (Castagnoli) as an unsigned number. The page can do something else in between. */
export async function crc32c(bytes: Uint8Array): Promise<number> {
  let rest = 0xffffffff;
  for (let begin = 0; begin < bytes.length; begin += stepBytes) {
    if (bytes.length > stepBytes) await new Promise<void>(inTaskOfItsOwn);
    rest = taken(rest, bytes.subarray(begin, begin + stepBytes));
  }
  return (rest ^ 0xffffffff) >>> 0;
}

function taken(rest: number, bytes: Uint8Array): number {
  const whole = bytes.length - (bytes.length % 8);
  for (let k = 0; k < whole; k += 8) {
    rest ^= bytes[k]! | (bytes[k + 1]! << 8) | (bytes[k + 2]! << 16) | (bytes[k + 3]! << 24);
    rest =
      t7[rest & 0xff]! ^
      t6[(rest >>> 8) & 0xff]! ^
      t5[(rest >>> 16) & 0xff]! ^
      t4[rest >>> 24]! ^
      t3[bytes[k + 4]!]! ^
      t2[bytes[k + 5]!]! ^
      t1[bytes[k + 6]!]! ^
      t0[bytes[k + 7]!]!;
  }
  for (let k = whole; k < bytes.length; ++k) rest = t0[(rest ^ bytes[k]!) & 0xff]! ^ (rest >>> 8);
  return rest;
}
