import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";

interface Property {
  name: string;
  type: string;
  /** For a list: the type of its length. */
  lengthType?: string;
}

interface Element {
  name: string;
  count: number;
  properties: Property[];
}

/** The largest value of PLY's widest integer type. */
const mostInList = 2 ** 32 - 1;

const sizes: Record<string, number> = {
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

/** PLY as text, or binary in either byte order. */
export function readPly(name: string, bytes: Uint8Array): Mesh {
  const { format, elements, length } = readHeader(name, bytes);
  const newReader = () =>
    format === "ascii"
      ? textReader(bytes, length)
      : binaryReader(bytes.subarray(length), format === "binary_little_endian");
  const reader = newReader();
  const builder = new MeshBuilder();
  for (const element of elements) {
    for (const what of besideOf(element)) builder.leftAside(what);
    for (let k = 0; k < element.count; ++k) readRow(name, element, k, reader, builder);
  }
  return builder.finish(name, (face) => `${name}${placeOfFace(name, elements, face, newReader())}: face ${face}`);
}

/** Reads up to the face once more. */
function placeOfFace(name: string, elements: readonly Element[], face: number, reader: Reader): string {
  const again = new MeshBuilder();
  for (const element of elements) {
    for (let k = 0; k < element.count; ++k) {
      readRow(name, element, k, reader, again);
      if (element.name === "face" && k === face) return reader.place();
    }
  }
  return "";
}

function readHeader(name: string, bytes: Uint8Array): { format: string; elements: Element[]; length: number } {
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
        if (!(type in sizes))
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

/** What properties stand for that a mesh here cannot hold. */
const beside: readonly (readonly [RegExp, string])[] = [
  [/^n[xyz]$/, "normals"],
  [/^(s|t|u|v|texture_[uv]|texcoord|texnumber)$/, "texture coordinates"],
  [/^(red|green|blue|alpha)$/, "colours"],
];

function besideOf({ name, count, properties }: Element): string[] {
  if (count === 0) return [];
  if (name !== "vertex" && name !== "face") return [`its element “${name}”`];
  const names = properties.map((property) => property.name);
  const own = name === "face" ? /^vertex_ind/ : /^[xyz]$/;
  const others = names.filter((property) => !own.test(property));
  // Properties that this page has written together with a distortion are written again.
  if (names.includes("distortion")) return others.filter((property) => !/^(distortion|red|green|blue)$/.test(property));
  return others.map((property) => beside.find(([key]) => key.test(property))?.[1] ?? `“${property}”`);
}

function countOf(where: string, [element, count]: readonly string[]): number {
  if (Number.isInteger(Number(count)) && Number(count) >= 0) return Number(count);
  throw new FileFault(`${where}: the element “${element}” has the count “${count}”.`);
}

function readRow(name: string, element: Element, row: number, reader: Reader, builder: MeshBuilder): void {
  const where = (of = "") => `${name}${reader.place()}, ${element.name} ${row}${of}`;
  const next = (type: string) => {
    const value = reader.next(type);
    if (value === undefined) throw new FileFault(`${where(` of ${element.count}`)}: the file ends before it is whole.`);
    return value;
  };
  const position = [NaN, NaN, NaN];
  let corners: number[] | undefined;
  for (const { name: property, type, lengthType } of element.properties) {
    if (lengthType) {
      const length = next(lengthType);
      if (!Number.isInteger(length) || length < 0 || length > mostInList) {
        throw new FileFault(`${where()}: a list of ${length} cannot be read.`);
      }
      const list: number[] = [];
      while (list.length < length) list.push(next(type));
      if (element.name === "face" && /^vertex_ind/.test(property)) corners = list;
    } else {
      const value = next(type);
      const axis = ["x", "y", "z"].indexOf(property);
      if (axis >= 0) position[axis] = value;
    }
  }
  if (element.name === "vertex") builder.vertex(position[0]!, position[1]!, position[2]!, where);
  if (element.name === "face") builder.polygon(corners ?? [], where);
}

/** The numbers of the rows, one after the other. */
interface Reader {
  /** Undefined at the end of the file. */
  next(type: string): number | undefined;
  /** Where the newest one stands: ", line 7"; nothing if the file has no lines. */
  place(): string;
}

function textReader(bytes: Uint8Array, begin: number): Reader {
  const toText = new TextDecoder();
  const text = toText.decode(bytes.subarray(begin));
  const words = text.split(/\s+/);
  const first = words[0] === "" ? 1 : 0;
  let at = first;
  const next = () => {
    const word = words[at++];
    return word === undefined || word === "" ? undefined : Number(word);
  };
  const linesIn = (text: string) => text.split("\n").length - 1;
  const place = () => {
    let count = at - first;
    let end = text.trimEnd().length;
    for (const { index } of text.matchAll(/\S+/g)) if (--count === 0) end = index;
    return `, line ${linesIn(toText.decode(bytes.subarray(0, begin))) + linesIn(text.slice(0, end)) + 1}`;
  };
  return { next, place };
}

function binaryReader(bytes: Uint8Array, littleEndian: boolean): Reader {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  const next = (type: string) => {
    const start = at;
    at += sizes[type]!;
    if (at > view.byteLength) return undefined;
    switch (type) {
      case "char":
      case "int8":
        return view.getInt8(start);
      case "uchar":
      case "uint8":
        return view.getUint8(start);
      case "short":
      case "int16":
        return view.getInt16(start, littleEndian);
      case "ushort":
      case "uint16":
        return view.getUint16(start, littleEndian);
      case "int":
      case "int32":
        return view.getInt32(start, littleEndian);
      case "uint":
      case "uint32":
        return view.getUint32(start, littleEndian);
      case "float":
      case "float32":
        return view.getFloat32(start, littleEndian);
      default:
        return view.getFloat64(start, littleEndian);
    }
  };
  return { next, place: () => "" };
}
