import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";
import { type Element, loadNumber, readPlyHeader, sizes } from "./ply_header.js";

/** The largest value of PLY's widest integer type. */
const mostInList = 2 ** 32 - 1;

/** PLY as text, or binary in either byte order. */
export function readPly(name: string, bytes: Uint8Array): Mesh {
  const { format, elements, length } = readPlyHeader(name, bytes);
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
  // The viewer writes these itself, each time from the present shape.
  if (names.join() === "x,y,z,distortion,red,green,blue") return [];
  return others.map((property) => beside.find(([key]) => key.test(property))?.[1] ?? `“${property}”`);
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
    return loadNumber(view, type, start, littleEndian);
  };
  return { next, place: () => "" };
}
