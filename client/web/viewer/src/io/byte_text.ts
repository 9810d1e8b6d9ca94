// Text of which each character stands for one byte, whatever encoding the file has: what stays of it comes back to the bit.

const toText = new TextDecoder("windows-1252"); // knows all bytes

/** Bytes by the numbers of their characters. */
const byteOf = new Map(Array.from({ length: 256 }, (_, byte) => [toText.decode(Uint8Array.of(byte)).charCodeAt(0), byte]));

export function byteText(bytes: Uint8Array): string {
  return toText.decode(bytes);
}

/** Of text that byteText() gave, in any order. */
export function bytesOfText(text: string): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; ++k) {
    const code = text.charCodeAt(k);
    bytes[k] = code < 0x80 ? code : byteOf.get(code)!;
  }
  return bytes;
}

/** How byteText() shows the mark with which some programs begin files in UTF-8. */
export const byteOrderMark = byteText(Uint8Array.of(0xef, 0xbb, 0xbf));
