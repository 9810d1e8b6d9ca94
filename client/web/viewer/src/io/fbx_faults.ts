import { FileFault } from "lpdeform-client/mesh/fault";
import { unzlibSync } from "three/addons/libs/fflate.module.js";
import { fbxNodes, type FbxNode, type FbxProperty, isBinaryFbx, versionOf } from "./fbx_nodes.js";

// What the meshes of an FBX file have that the reader of three.js would leave out or tear without a word is refused by the geometry, its
// line if the file is text, and the number of the polygon. Polygons and vertices count from 0, as the file does.

interface Numbers {
  /** The file's name, and the line if it is text. */
  where: string;
  /** As the file says. */
  count: number;
  /** NaN if a number is none. */
  values: ArrayLike<number>;
}

interface Geometry {
  where: string;
  id: string;
  name: string;
  kind: string;
  places?: Numbers;
  corners?: Numbers;
  layers: Layer[];
}

/** What vertices and polygons have beside their places, such as LayerElementUV. */
interface Layer {
  where: string;
  name: string;
  /** Its ways of mapping and of reference. */
  ways: Set<string>;
  /** The names of what stands in it. */
  parts: Set<string>;
}

/** What the reader needs of each layer, and what else if it is indexed. */
const layerParts: Readonly<Record<string, readonly [string, string?]>> = {
  LayerElementNormal: ["Normals"],
  LayerElementUV: ["UV", "UVIndex"],
  LayerElementColor: ["Colors", "ColorIndex"],
  LayerElementMaterial: ["Materials"],
};
const layerName = /^LayerElement\w+$/;

interface Contents {
  geometries: Geometry[];
  models: Set<string>;
  /** Pairs of a part's id and the id of that to which it belongs. */
  connections: (readonly [string, string])[];
}

/** Throws a FileFault. */
export function checkFbx(name: string, bytes: Uint8Array<ArrayBuffer>): void {
  const isBinary = isBinaryFbx(bytes);
  if (isBinary && bytes[20] !== 0) {
    throw new FileFault(`${name}: byte 20 is ${bytes[20]} in place of 0; the file was changed as if it were text.`);
  }
  const text = isBinary ? "" : new TextDecoder().decode(bytes);
  if (isBinary ? versionOf(bytes) < 6400 : !(Number(/FBXVersion: (\d+)/.exec(text)?.[1]) >= 7000)) return; // the reader says so
  const { geometries, models, connections } = isBinary ? binaryContents(name, bytes) : textContents(name, text);
  if (geometries.length === 0) throw new FileFault(`${name} has no Geometry, so there is nothing to show.`);
  const owned = new Set(connections.filter(([, owner]) => models.has(owner)).map(([part]) => part));
  for (const geometry of geometries) {
    if (geometry.kind !== "Mesh") continue;
    const called = `the geometry ${geometry.id} “${geometry.name}”`;
    const fault = (where: string, what: string) => new FileFault(`${where}: ${called} ${what}.`);
    checkNumbers(geometry, fault);
    checkPolygons(geometry, fault);
    checkLayers(geometry, fault);
    if (!owned.has(geometry.id)) throw fault(geometry.where, "belongs to no model: the connections name none");
  }
}

type Fault = (where: string, what: string) => FileFault;

function checkNumbers({ places, corners }: Geometry, fault: Fault): void {
  for (const [what, numbers] of [
    ["Vertices", places],
    ["PolygonVertexIndex", corners],
  ] as const) {
    if (numbers && numbers.values.length !== numbers.count) {
      throw fault(numbers.where, `says that its ${what} are ${numbers.count} numbers, and has ${numbers.values.length}`);
    }
  }
  if (!places) return;
  if (places.count % 3 !== 0)
    throw fault(places.where, `has ${places.count} numbers for its Vertices, which is no multiple of 3`);
  for (let k = 0; k < places.count; ++k) {
    if (!Number.isFinite(places.values[k]))
      throw fault(places.where, `has a vertex ${Math.floor(k / 3)} without three finite numbers`);
  }
}

function checkPolygons({ where, places, corners }: Geometry, fault: Fault): void {
  if (!corners) {
    if (places && places.count > 0) throw fault(where, "has no polygons (PolygonVertexIndex)");
    return;
  }
  const vertexCount = (places?.count ?? 0) / 3;
  let [polygon, size] = [0, 0];
  for (let k = 0; k < corners.count; ++k) {
    const corner = corners.values[k]!;
    if (!Number.isInteger(corner)) throw fault(corners.where, `has a polygon ${polygon} with a corner that is no whole number`);
    const vertex = corner < 0 ? -corner - 1 : corner; // the last corner of each polygon is turned about
    if (vertex >= vertexCount) {
      throw fault(corners.where, `has a polygon ${polygon} with vertex ${vertex}; there are ${vertexCount}, counted from 0`);
    }
    ++size;
    if (corner >= 0) continue;
    if (size < 3) throw fault(corners.where, `has a polygon ${polygon} with ${size} corners`);
    ++polygon;
    size = 0;
  }
  if (size > 0) throw fault(corners.where, `has a polygon ${polygon} without an end`);
}

function checkLayers({ layers }: Geometry, fault: Fault): void {
  for (const { where, name, ways, parts } of layers) {
    const needed = layerParts[name];
    if (!needed || ways.has("NoMappingInformation")) continue;
    const [array, index] = needed;
    // The reader passes over colours and places in a texture that are not there.
    const isUnread = !parts.has(array) && index !== undefined;
    const missing = [array, ways.has("IndexToDirect") ? index : undefined].find(
      (part) => part !== undefined && !parts.has(part),
    );
    if (missing !== undefined && !isUnread) throw fault(where, `has a ${name} without ${missing}`);
  }
}

const layerOf = (where: string, name: string): Layer => ({ where, name, ways: new Set(), parts: new Set() });

const plainName = (name: string) => name.split("\0")[0]!.replace(/^\w+::/, "");

function binaryContents(file: string, bytes: Uint8Array<ArrayBuffer>): Contents {
  const contents: Contents = { geometries: [], models: new Set(), connections: [] };
  const text = ({ begin, end }: FbxProperty) => new TextDecoder().decode(bytes.subarray(begin, end));
  const id = ({ type, begin }: FbxProperty) => {
    const view = new DataView(bytes.buffer, bytes.byteOffset);
    return type === "L" ? String(view.getBigInt64(begin, true)) : type === "I" ? String(view.getInt32(begin, true)) : "";
  };
  let last: FbxNode | undefined;
  let isCut = false;
  try {
    for (const node of fbxNodes(bytes)) {
      last = node;
      const { name, end, properties } = node;
      isCut ||= end > bytes.length;
      const [first, second, third] = properties;
      const geometry = contents.geometries.at(-1);
      if (name === "Model" && first) contents.models.add(id(first));
      if (name === "C" && first && second && third && text(first) === "OO") contents.connections.push([id(second), id(third)]);
      if (name === "Geometry" && first && second && third) {
        contents.geometries.push({ where: file, id: id(first), name: plainName(text(second)), kind: text(third), layers: [] });
      }
      const layer = geometry?.layers.at(-1);
      if (layerName.test(name)) geometry?.layers.push(layerOf(file, name));
      else layer?.parts.add(name);
      if (/^(Mapping|Reference)InformationType$/.test(name) && layer && first) layer.ways.add(text(first));
      if (geometry && name === "Vertices") geometry.places = numbersOf(file, bytes, node, geometry);
      if (geometry && name === "PolygonVertexIndex") geometry.corners = numbersOf(file, bytes, node, geometry);
    }
  } catch (error) {
    if (!(error instanceof RangeError)) throw error;
    isCut = true;
  }
  if (isCut) {
    const where = last ? `in or after its node “${last.name}” at byte ${last.at}` : "before its first node";
    throw new FileFault(`${file} ends too soon, ${where}: it has ${bytes.length} bytes.`);
  }
  return contents;
}

function numbersOf(file: string, bytes: Uint8Array<ArrayBuffer>, node: FbxNode, geometry: Geometry): Numbers {
  const fault = (what: string) =>
    new FileFault(`${file}: the ${node.name} of the geometry ${geometry.id} “${geometry.name}” at byte ${node.at} ${what}.`);
  const [array] = node.properties;
  if (!array || !/^[fdil]$/.test(array.type)) throw fault("are no array of numbers");
  if (array.end > bytes.length) throw new RangeError();
  let data = bytes.slice(array.begin, array.end);
  if (array.isPacked) {
    try {
      data = unzlibSync(data) as Uint8Array<ArrayBuffer>;
    } catch {
      throw fault("are damaged");
    }
  }
  const buffer = data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength - (data.byteLength % array.width));
  const values = {
    f: () => new Float32Array(buffer),
    d: () => new Float64Array(buffer),
    i: () => new Int32Array(buffer),
    l: () => Array.from(new BigInt64Array(buffer), Number),
  }[array.type as "f" | "d" | "i" | "l"]();
  return { where: file, count: array.length, values };
}

/** Lines of an FBX file in text that say something here. */
const heads = new RegExp(
  "^[ \\t]*(?:" +
    [
      /(?<kind>Geometry|Model): *(?<id>-?\d+), *"(?<name>[^"]*)", *"(?<type>[^"]*)"/,
      /(?<array>Vertices|PolygonVertexIndex): *\*(?<count>\d+) *\{(?<body>[^}]*)/,
      /(?<layer>LayerElement\w+): *\d+ *\{/,
      /(?<part>Normals|UV|UVIndex|Colors|ColorIndex|Materials): *\*/,
      /(?<way>(?:Mapping|Reference)InformationType): *"(?<how>\w*)"/,
      /C: *"OO", *(?<from>-?\d+), *(?<to>-?\d+)/,
    ]
      .map(({ source }) => source)
      .join("|") +
    ")",
  "gm",
);

function textContents(file: string, text: string): Contents {
  const contents: Contents = { geometries: [], models: new Set(), connections: [] };
  checkBraces(file, text);
  let [line, counted] = [1, 0];
  for (const { index, groups } of text.matchAll(heads)) {
    const { kind, id = "", name = "", type = "", array, count, body = "", layer, part, way, how = "", from, to = "" } = groups!;
    line += linesIn(text.slice(counted, index)) - 1;
    counted = index;
    const where = `${file}, line ${line}`;
    if (kind === "Model") contents.models.add(id);
    if (kind === "Geometry" && !text.startsWith("\tGeometry", index)) {
      throw new FileFault(`${where}: “Geometry” is not indented by one tab, as this page wants it.`);
    }
    if (kind === "Geometry") contents.geometries.push({ where, id, name: plainName(name), kind: type, layers: [] });
    if (from) contents.connections.push([from, to]);
    const geometry = contents.geometries.at(-1);
    if (!geometry) continue;
    if (array === "Vertices") geometry.places = { where, count: Number(count), values: numbersIn(body) };
    if (array === "PolygonVertexIndex") geometry.corners = { where, count: Number(count), values: numbersIn(body) };
    if (layer) geometry.layers.push(layerOf(where, layer));
    if (part) geometry.layers.at(-1)?.parts.add(part);
    if (way) geometry.layers.at(-1)?.ways.add(how);
  }
  return contents;
}

const linesIn = (text: string) => text.split(/\r\n?|\n/).length;

function numbersIn(body: string): number[] {
  const words = body.replace(/^\s*a:/, "").split(",");
  if (words.at(-1)!.trim() === "") words.pop();
  return words.map((word) => (word.trim() ? Number(word) : NaN));
}

function checkBraces(file: string, text: string): void {
  const whereIs = (at: number) => `${file}, line ${linesIn(text.slice(0, at))}`;
  const open: number[] = [];
  for (const { 0: sign, index } of text.matchAll(/"[^"]*"|;[^\n]*|[{}]/g)) {
    if (sign === "{") open.push(index);
    if (sign === "}" && open.pop() === undefined) throw new FileFault(`${whereIs(index)}: this } ends nothing.`);
  }
  const last = open.at(-1);
  if (last === undefined) return;
  const head = text.slice(text.lastIndexOf("\n", last) + 1, last).trim();
  throw new FileFault(`${whereIs(last).replace(`${file}, `, `${file} ends too soon: “${head}” of `)} has no end.`);
}
