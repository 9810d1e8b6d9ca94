import { crc32, deflateSync } from "node:zlib";

/** A PNG of these pixels: red, green, blue of each, row by row. */
export function pngOf(width: number, height: number, pixels: readonly number[]): Uint8Array<ArrayBuffer> {
  const rows = Array.from({ length: height }, (_, row) => [0, ...pixels.slice(3 * width * row, 3 * width * (row + 1))]);
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head.set([8, 2, 0, 0, 0], 8);
  const chunk = (name: string, bytes: Uint8Array) => {
    const body = Buffer.concat([Buffer.from(name), bytes]);
    const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
    length.writeUInt32BE(bytes.length);
    sum.writeUInt32BE(crc32(body));
    return Buffer.concat([length, body, sum]);
  };
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  const image = deflateSync(Uint8Array.from(rows.flat()));
  return Buffer.concat([signature, chunk("IHDR", head), chunk("IDAT", image), chunk("IEND", Buffer.alloc(0))]);
}
