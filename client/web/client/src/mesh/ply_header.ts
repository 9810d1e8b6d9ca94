import { FileFault } from "./fault.js";

export interface Property {
  name: string;
  type: string;
  /** For a list: the type of its length. */
  lengthType?: string;
}

export interface Element {
  name: string;
  count: number;
  properties: Property[];
}

export interface PlyHeader {
  /** "ascii", "binary_little_endian" or "binary_big_endian". */
  format: string;
  elements: Element[];
  /** In bytes. */
  length: number;
}

/** Of each type, in bytes. */
export const sizes: Record<string, number> = {
  char: 1,
  uchar: 1,
  short: 2,
  ushort: 2,
  int: 4,
  uint: 4,
  float: 4,
  double: 8,
  int8: 1,
  uint8: 1,
  int16: 2,
  uint16: 2,
  int32: 4,
  uint32: 4,
  float32: 4,
  float64: 8,
};

/** Throws a FileFault. */
export function readPlyHeader(name: string, bytes: Uint8Array): PlyHeader {
  const head = new TextDecoder("latin1").decode(bytes.subarray(0, 65_536));
  const end = /(^|\n)end_header\r?\n/.exec(head);
  if (!head.startsWith("ply") || !end) throw new FileFault(`${name} has no PLY header.`);
  let format = "";
  const elements: Element[] = [];
  for (const [k, line] of head.slice(0, end.index).split(/\r?\n/).entries()) {
    const where = `${name}, line ${k + 1}`;
    const [key, ...words] = line.trim().split(/\s+/);
    if (key === "format") format = words[0] ?? "";
    if (key === "element") elements.push({ name: words[0] ?? "", count: countOf(where, words), properties: [] });
    if (key === "property") {
      const property: Property =
        words[0] === "list"
          ? { name: words[3] ?? "", type: words[2] ?? "", lengthType: words[1] ?? "" }
          : { name: words[1] ?? "", type: words[0] ?? "" };
      for (const type of [property.type, property.lengthType ?? property.type]) {
        if (!Object.hasOwn(sizes, type))
          throw new FileFault(`${where}: a property has the type ${type}, which PLY does not know.`);
      }
      elements.at(-1)?.properties.push(property);
    }
  }
  if (!["ascii", "binary_little_endian", "binary_big_endian"].includes(format)) {
    throw new FileFault(`${name} is in the format “${format}”, which PLY does not know.`);
  }
  for (const { name: element, count, properties } of elements) {
    // Rows without bytes would be read for ever.
    if (count > 0 && properties.length === 0) throw new FileFault(`Element “${element}” of ${name} has no property.`);
  }
  return { format, elements, length: end.index + end[0].length };
}

function countOf(where: string, [element, count]: readonly string[]): number {
  if (Number.isInteger(Number(count)) && Number(count) >= 0) return Number(count);
  throw new FileFault(`${where}: the element “${element}” has the count “${count}”.`);
}

/** A number of a binary file. */
export function loadNumber(view: DataView, type: string, at: number, littleEndian: boolean): number {
  switch (type) {
    case "char":
    case "int8":
      return view.getInt8(at);
    case "uchar":
    case "uint8":
      return view.getUint8(at);
    case "short":
    case "int16":
      return view.getInt16(at, littleEndian);
    case "ushort":
    case "uint16":
      return view.getUint16(at, littleEndian);
    case "int":
    case "int32":
      return view.getInt32(at, littleEndian);
    case "uint":
    case "uint32":
      return view.getUint32(at, littleEndian);
    case "float":
    case "float32":
      return view.getFloat32(at, littleEndian);
    default:
      return view.getFloat64(at, littleEndian);
  }
}
