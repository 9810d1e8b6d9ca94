import type { Mesh } from "lpdeform-client/mesh/mesh";
import { type Element, loadNumber, type PlyHeader, readPlyHeader, sizes } from "lpdeform-client/mesh/ply_header";
import { bytesOfText, byteText } from "./byte_text.js";
import { type Numbers, NormalTurner } from "./turned_normals.js";

const axes = ["x", "y", "z"];
const normalAxes = ["nx", "ny", "nz"];
const isFloat = (type: string) => /^(float|double|float32|float64)$/.test(type);

/** For each property of a vertex, in the order of the file, what it becomes; undefined: what it was. `old`: what it was. */
type NewRow = (vertex: number, old: (property: number) => number) => readonly (number | undefined)[];

/**
 * Whether the mesh came from a PLY with more than a mesh here holds, which rewritePly() can keep. It cannot where coordinates are
 * integers, or where vertices come in several parts.
 */
export function keepsPly(mesh: Mesh): mesh is Mesh & { ply: Uint8Array } {
  if (!mesh.ply) return false;
  const header = readPlyHeader(mesh.name, mesh.ply);
  if (header.elements.filter(({ name }) => name === "vertex").length > 1) return false;
  const { properties } = vertexOf(header);
  const changing = properties.filter(({ name }) => [...axes, ...normalAxes, "distortion"].includes(name));
  return changing.every(({ type, lengthType }) => isFloat(type) && !lengthType);
}

/**
 * The PLY file with new positions. Everything stays as it is, except the coordinates of vertices, their normals, which turn with the
 * surface, and their `distortion`, which is added if the file has none. `mesh`: for which keepsPly() holds.
 */
export function rewritePly(
  { ply, name, positions: drawn, exact, faces }: Mesh & { ply: Uint8Array },
  positions: Numbers,
  distortion: Numbers,
): Uint8Array<ArrayBuffer> {
  const header = readPlyHeader(name, ply);
  const { properties } = vertexOf(header);
  const names = properties.map((property) => property.name);
  const isAdded = !names.includes("distortion");
  const normal = normalAxes.map((axis) => names.indexOf(axis));
  const turner = normal.includes(-1) ? undefined : new NormalTurner(exact ?? drawn, positions, faces);
  const type = properties.find((property) => property.name === "x")!.type;
  const newRow: NewRow = (vertex, old) => {
    const turned = turner?.turned(vertex, normal.map(old));
    const values = names.map((one) =>
      axes.includes(one)
        ? positions[3 * vertex + axes.indexOf(one)]
        : normalAxes.includes(one)
          ? turned?.[normalAxes.indexOf(one)]
          : one === "distortion"
            ? distortion[vertex]
            : undefined,
    );
    return isAdded ? [...values, distortion[vertex]] : values;
  };
  const head = byteText(ply.subarray(0, header.length));
  const newHead = bytesOfText(isAdded ? withProperty(head, `property ${type} distortion`) : head);
  const types = [...properties.map((property) => property.type), ...(isAdded ? [type] : [])];
  const body = header.format === "ascii" ? textBody(ply, header, types, newRow) : binaryBody(ply, header, types, newRow);
  const whole = new Uint8Array(newHead.length + body.length);
  whole.set(newHead);
  whole.set(body, newHead.length);
  return whole;
}

/** A mesh has one. */
function vertexOf({ elements }: PlyHeader): Element {
  return elements.find(({ name }) => name === "vertex")!;
}

/** After the last property of the vertices. */
function withProperty(head: string, line: string): string {
  const lines = head.split("\n");
  const element = lines.findIndex((one) => /^\s*element\s+vertex\s/.test(one));
  const next = lines.findIndex((one, k) => k > element && /^\s*(element|end_header)\b/.test(one));
  const last = lines.findLastIndex((one, k) => k < next && /^\s*property\s/.test(one));
  return lines.toSpliced(last + 1, 0, line + (lines[last]!.endsWith("\r") ? "\r" : "")).join("\n");
}

/** `types`: of the vertices' new properties. */
function binaryBody(ply: Uint8Array, header: PlyHeader, types: readonly string[], newRow: NewRow): Uint8Array {
  const isLittle = header.format === "binary_little_endian";
  const [from, vertex] = [new DataView(ply.buffer, ply.byteOffset, ply.byteLength), vertexOf(header)];
  const isAdded = types.length > vertex.properties.length;
  const more = isAdded ? vertex.count * sizes[types.at(-1)!]! : 0;
  const out = new Uint8Array(ply.length - header.length + more);
  const to = new DataView(out.buffer);
  let [at, end] = [header.length, 0];
  for (const element of header.elements) {
    for (let row = 0; row < element.count; ++row) {
      const begin = at;
      const places = element.properties.map(({ type, lengthType }) => {
        const place = at;
        const count = lengthType ? loadNumber(from, lengthType, at, isLittle) : 1;
        at += (lengthType ? sizes[lengthType]! : 0) + count * sizes[type]!;
        return place;
      });
      out.set(ply.subarray(begin, at), end);
      if (element === vertex) {
        const old = (k: number) => loadNumber(from, types[k]!, places[k]!, isLittle);
        newRow(row, old).forEach((value, k) => {
          if (value !== undefined) store(to, types[k]!, end + (places[k] ?? at) - begin, value, isLittle);
        });
        if (isAdded) end += sizes[types.at(-1)!]!;
      }
      end += at - begin;
    }
  }
  out.set(ply.subarray(at), end);
  return out;
}

function store(view: DataView, type: string, at: number, value: number, isLittle: boolean): void {
  if (sizes[type] === 4) view.setFloat32(at, value, isLittle);
  else view.setFloat64(at, value, isLittle);
}

function textBody(ply: Uint8Array, header: PlyHeader, types: readonly string[], newRow: NewRow): Uint8Array {
  const vertex = vertexOf(header);
  /** Words have even numbers, and what is between them has odd ones. */
  const parts = byteText(ply.subarray(header.length)).split(/(\s+)/);
  let at = parts[0] === "" ? 2 : 0;
  for (const element of header.elements) {
    for (let row = 0; row < element.count; ++row) {
      const places = element.properties.map(({ lengthType }) => {
        const place = at;
        at += 2 * (lengthType ? 1 + Number(parts[at]) : 1);
        return place;
      });
      if (element !== vertex) continue;
      newRow(row, (k) => Number(parts[places[k]!])).forEach((value, k) => {
        if (value === undefined) return;
        const place = places[k];
        if (place !== undefined) parts[place] = written(value, types[k]!);
        else parts[at - 2] += ` ${written(value, types[k]!)}`;
      });
    }
  }
  return bytesOfText(parts.join(""));
}

/** With as many digits as the type holds. */
function written(value: number, type: string): string {
  return String(sizes[type] === 4 ? Number(Math.fround(value).toPrecision(9)) : value);
}
