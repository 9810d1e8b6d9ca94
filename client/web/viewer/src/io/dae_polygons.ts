import type { FileFault } from "lpdeform-client/mesh/fault";
import { child, childrenOf, type Element, wordsOf, type XmlText } from "./xml.js";

// The elements of a COLLADA mesh that have faces. What is wrong in them is refused by its line.

/** What the items are that an element of this name has. */
const kinds: Readonly<Record<string, "polygon" | "strip" | "fan">> = {
  triangles: "polygon",
  polylist: "polygon",
  polygons: "polygon",
  tristrips: "strip",
  trifans: "fan",
};

export const isFaces = ({ name }: Element): boolean => Object.hasOwn(kinds, name);

export interface Source {
  /** Of points, or whatever it has. */
  count: number;
  /** How many numbers each has. */
  stride: number;
}

export interface FaceInput {
  element: Element;
  offset: number;
  source: Source;
}

/** All polygons, strips or fans of an element. */
export interface Faces {
  element: Element;
  kind: "polygon" | "strip" | "fan";
  inputs: readonly FaceInput[];
  /** How many indices a corner has. */
  stride: number;
  /** Of all corners, one item after the other. */
  indices: readonly number[];
  /** How many corners each item has, those of holes too. Undefined if all are triangles. */
  counts: readonly number[] | undefined;
  /** By polygon: how many corners its outline and each of its holes have. */
  holes: ReadonlyMap<number, readonly number[]>;
  /** Where the indices stand: one place for each item, or for all. */
  lists: readonly number[];
}

type Lists = Pick<Faces, "indices" | "counts" | "holes" | "lists">;
type Fault = (what: string, at?: number) => FileFault;

const noHoles: ReadonlyMap<number, readonly number[]> = new Map();

/** `called`: the geometry, in words. `sourceOf`: what an input names. Throws a FileFault. */
export function readFaces(
  xml: XmlText,
  element: Element,
  called: string,
  vertices: Element,
  sourceOf: (input: Element) => Source,
): Faces {
  const { name } = element;
  const kind = kinds[name]!;
  const fault: Fault = (what, at = element.at) => xml.fault(at, `<${name}> of ${called} ${what}`);
  const said = element.attributes["count"] ?? "";
  if (!/^\d+$/.test(said)) throw fault(`has the count “${said}”`);
  const inputs = checkedInputs(element, vertices, fault).map((one) => ({ element: one, offset: offsetOf(one) }));
  const stride = inputs.reduce((most, { offset }) => Math.max(most, offset), 0) + 1;
  const hasOneList = name === "triangles" || name === "polylist";
  const lists = hasOneList
    ? oneList(xml, element, Number(said), stride, fault)
    : manyLists(xml, element, Number(said), stride, fault);
  const known = inputs.map((input) => ({ ...input, source: sourceOf(input.element) }));
  for (const input of known) checkIndices(lists, kind, input, stride, fault);
  return { element, kind, inputs: known, stride, ...lists };
}

export const isVertex = ({ attributes }: Element): boolean => attributes["semantic"] === "VERTEX";

const offsetOf = ({ attributes }: Element) => Number(attributes["offset"]);

function checkedInputs(faces: Element, vertices: Element, fault: Fault): Element[] {
  const inputs = childrenOf(faces, "input");
  if (!inputs.some(isVertex)) throw fault("has no input VERTEX");
  for (const { attributes, at } of inputs) {
    const { semantic, source, offset = "" } = attributes;
    if (!/^\d+$/.test(offset)) throw fault(`has an input ${semantic} with the offset “${offset}”`, at);
    if (semantic === "VERTEX" && source !== `#${vertices.attributes["id"]}`) {
      throw fault(`names “${source}”, which is no <vertices> of its <mesh>`, at);
    }
  }
  return inputs;
}

/** Of <triangles> or a <polylist>. */
function oneList(xml: XmlText, faces: Element, count: number, stride: number, fault: Fault): Lists {
  const all = childrenOf(faces, "p");
  const holed = child(faces, "ph");
  if (holed) throw fault("has a polygon with holes (<ph>), which only <polygons> can have", holed.at);
  if (all.length !== 1) throw fault(`has ${all.length} lists <p> in place of 1`);
  const list = all[0]!;
  const indices = indicesIn(xml, list);
  const counts = faces.name === "triangles" ? undefined : cornersOf(xml, faces, fault);
  const polygonCount = counts?.length ?? count;
  if (polygonCount !== count) throw fault(`says that it has ${count} polygons, and has ${polygonCount}`);
  const wanted = stride * (counts ? counts.reduce((sum, one) => sum + one, 0) : 3 * count);
  if (wanted !== indices.length) {
    throw fault(`has ${count} polygons, for which <p> needs ${wanted} numbers; it has ${indices.length}`, list.at);
  }
  return { indices, counts, holes: noHoles, lists: [list.at] };
}

/** How many corners each polygon of a <polylist> has. */
function cornersOf(xml: XmlText, faces: Element, fault: Fault): number[] {
  const list = child(faces, "vcount");
  if (!list) throw fault("has no <vcount>");
  const corners = indicesIn(xml, list);
  const few = corners.findIndex((one) => one < 3);
  if (few >= 0) throw fault(`has a polygon ${few} with ${corners[few]} corners`, list.at);
  return corners;
}

/** Of <polygons>, <tristrips> or <trifans>, where each item has its own. */
function manyLists(xml: XmlText, faces: Element, count: number, stride: number, fault: Fault): Lists {
  const kind = kinds[faces.name]!;
  const [indices, counts, lists]: [number[], number[], number[]] = [[], [], []];
  const holes = new Map<number, number[]>();
  for (const list of faces.children) {
    if (!["p", "ph", "h"].includes(list.name)) continue;
    const own = `a ${kind} ${counts.length}`;
    const sizes = ringsOf(list, kind, own, fault).map((ring, k) => {
      const ownCount = indicesIn(xml, ring, indices);
      const size = ownCount / stride;
      const what = k === 0 ? `${own} with` : `${own} with a hole ${k - 1} of`;
      if (!Number.isInteger(size)) {
        throw fault(`has ${what} ${ownCount} indices, which is no multiple of the ${stride} of a corner`, ring.at);
      }
      if (size < 3) throw fault(`has ${what} ${size} corners`, ring.at);
      return size;
    });
    if (sizes.length > 1) holes.set(counts.length, sizes);
    counts.push(sizes.reduce((sum, size) => sum + size));
    lists.push(list.at);
  }
  if (counts.length !== count) throw fault(`says that it has ${count} ${kind}s, and has ${counts.length}`);
  return { indices, counts, holes, lists };
}

/** The outline, and after it the holes. */
function ringsOf(list: Element, kind: Faces["kind"], own: string, fault: Fault): Element[] {
  if (list.name === "p") return [list];
  if (list.name === "h") throw fault(`has a hole <h> before ${own} that is in no <ph>`, list.at);
  if (kind !== "polygon") throw fault(`has ${own} with holes (<ph>), which only <polygons> can have`, list.at);
  const outlines = childrenOf(list, "p");
  if (outlines.length !== 1) throw fault(`has ${own} with ${outlines.length} outlines <p> in place of 1`, list.at);
  return [...outlines, ...childrenOf(list, "h")];
}

function indicesIn(xml: XmlText, list: Element): number[];
/** Appends them, and returns their number. */
function indicesIn(xml: XmlText, list: Element, all: number[]): number;
function indicesIn(xml: XmlText, list: Element, all?: number[]): number[] | number {
  const words = wordsOf(list.text);
  const wrong = words.find((word) => !/^\d+$/.test(word));
  if (wrong !== undefined) throw xml.fault(list.at, `<${list.name}> has “${wrong}”, which is no whole number from 0`);
  if (!all) return words.map(Number);
  for (const word of words) all.push(Number(word));
  return words.length;
}

function checkIndices(faces: Lists, kind: string, { element, offset, source }: FaceInput, stride: number, fault: Fault): void {
  const { indices, counts, lists } = faces;
  for (let at = offset; at < indices.length; at += stride) {
    if (indices[at]! < source.count) continue;
    const item = itemOf(counts, Math.floor(at / stride));
    const what = isVertex(element) ? "vertex" : element.attributes["semantic"];
    const has = `has a ${kind} ${item} with ${what} ${indices[at]}; there are ${source.count}, counted from 0`;
    throw fault(has, lists[item] ?? lists[0]);
  }
}

/** To which polygon, strip or fan a corner belongs. */
function itemOf(counts: readonly number[] | undefined, corner: number): number {
  if (!counts) return Math.floor(corner / 3);
  let [item, end] = [0, counts[0] ?? 0];
  while (end <= corner) end += counts[++item]!;
  return item;
}
