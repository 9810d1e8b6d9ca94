import type { FileFault } from "lpdeform-client/mesh/fault";
import { checkCopies, type Use } from "./uses.js";
import { type Element, elementsIn, isNumber, wordsOf, XmlText } from "./xml.js";

// What a COLLADA file has that the reader of three.js would leave out or tear without a word is refused by its line. Everything counts
// from 0, as the file does.

const faceKinds = ["triangles", "polylist", "polygons"];
const lineKinds = ["lines", "linestrips"];
const unreadKinds = ["tristrips", "trifans"];
const numberCounts: Readonly<Record<string, number>> = {
  matrix: 16,
  bind_shape_matrix: 16,
  translate: 3,
  scale: 3,
  rotate: 4,
};
/** Elements that name another one by their attribute “url”, and what it is. */
const instances: Readonly<Record<string, string>> = {
  instance_visual_scene: "visual_scene",
  instance_node: "node",
  instance_geometry: "geometry",
  instance_controller: "controller",
  instance_effect: "effect",
};

/** What has no part in the shapes that are shown: what other programs want, and physics. */
const passedOver = ["extra", "library_physics_models", "library_physics_scenes"];

/** Throws a FileFault. */
export function checkDae(name: string, text: string): void {
  const xml = new XmlText(name, text);
  const root = xml.root();
  if (root.name !== "COLLADA") throw xml.fault(root.at, `the file begins with <${root.name}>, and COLLADA with <COLLADA>`);
  for (const needed of ["asset", "scene"]) if (!child(root, needed)) throw xml.fault(root.at, `<COLLADA> has no <${needed}>`);
  const all = [...elementsIn(root, passedOver)];
  const named = new Map<string, Element>();
  for (const element of all) {
    const { id } = element.attributes;
    if (id) named.set(`#${id}`, element).set(`${element.name}#${id}`, element);
  }
  for (const element of all) {
    checkNumbers(xml, element);
    checkReference(xml, element, named);
    if (element.name === "geometry") checkGeometry(xml, element);
  }
  const uses = all.flatMap((element) => (element.name === "node" ? usesIn(xml, element) : []));
  const copies = uses.filter(({ name }) => name === "instance_node");
  checkCopies("node", uses, copies);
}

/** What a node has in it. A node without an id is called by its place. */
function usesIn(xml: XmlText, node: Element): Use[] {
  const keyOf = ({ attributes, at }: Element) => attributes["id"] ?? `at ${at}`;
  return node.children.flatMap((part) => {
    const { name, attributes, at } = part;
    if (name !== "node" && !/^instance_(node|geometry|controller)$/.test(name)) return [];
    const address = attributes["url"] ?? "";
    const object = name === "node" ? keyOf(part) : name === "instance_node" ? address.slice(1) : address;
    return [{ xml, at, name, object, by: keyOf(node) }];
  });
}

const child = (element: Element, name: string): Element | undefined => element.children.find((one) => one.name === name);
const childrenOf = (element: Element, name: string) => element.children.filter((one) => one.name === name);
const idOf = ({ attributes }: Element) => attributes["id"] ?? attributes["name"] ?? "";

function checkNumbers(xml: XmlText, element: Element): void {
  const { name, attributes, at } = element;
  if (
    name === "unit" &&
    "meter" in attributes &&
    !(Number(attributes["meter"]) > 0 && Number.isFinite(Number(attributes["meter"])))
  ) {
    throw xml.fault(at, `<unit> has the size “${attributes["meter"]}”, which is no number above 0`);
  }
  if (!Object.hasOwn(numberCounts, name)) return;
  const words = wordsOf(element.text);
  const wrong = words.find((word) => !isNumber(word));
  if (wrong !== undefined) throw xml.fault(at, `<${name}> has “${wrong}”, which is no number`);
  if (words.length !== numberCounts[name]) {
    throw xml.fault(at, `<${name}> has ${words.length} numbers in place of ${numberCounts[name]}`);
  }
}

/** `named`: elements by “#” and their id, and by their name, “#” and their id; those of different names may share an id. */
function checkReference(xml: XmlText, { name, attributes, at }: Element, named: ReadonlyMap<string, Element>): void {
  const kind = Object.hasOwn(instances, name) ? instances[name]! : undefined;
  if (!kind && name !== "skin" && name !== "input") return;
  const address = attributes[kind ? "url" : "source"] ?? "";
  const target = address.startsWith("#") ? named.get(`${kind ?? ""}${address}`) : undefined;
  if (!target) throw xml.fault(at, `<${name}> names “${address}”, which is no ${kind ? `<${kind}>` : "element"} of the file`);
  if (name === "instance_geometry" && !child(target, "mesh")) {
    const kind = target.children[0] ? `a <${target.children[0].name}>` : "nothing";
    throw xml.fault(target.at, `the geometry “${idOf(target)}” has ${kind} in place of a <mesh>`);
  }
}

interface Source {
  /** Of points, or whatever it has. */
  count: number;
}

type Sources = ReadonlyMap<string | undefined, Source>;

function checkGeometry(xml: XmlText, geometry: Element): void {
  const mesh = child(geometry, "mesh");
  if (!mesh) return;
  const of = `the geometry “${idOf(geometry)}”`;
  const sources = new Map(childrenOf(mesh, "source").map((source) => [source.attributes["id"], sourceOf(xml, source)]));
  const vertices = child(mesh, "vertices");
  const position = vertices && childrenOf(vertices, "input").find(({ attributes }) => attributes["semantic"] === "POSITION");
  if (!vertices || !position) throw xml.fault(mesh.at, `${of} has no <vertices> with a POSITION`);
  checkPlaces(
    xml,
    childrenOf(mesh, "source").find((source) => `#${source.attributes["id"]}` === position.attributes["source"]),
  );
  for (const input of childrenOf(vertices, "input")) known(xml, input, sources);
  for (const primitive of mesh.children) {
    const { name } = primitive;
    if (unreadKinds.includes(name)) {
      throw xml.fault(
        primitive.at,
        `${of} has <${name}>, of which this page knows nothing; it reads <${faceKinds.join(">, <")}>`,
      );
    }
    if (faceKinds.includes(name)) checkFaces(xml, primitive, of, vertices, known(xml, position, sources), sources);
    if (lineKinds.includes(name) && !childrenOf(primitive, "input").some(isVertex)) {
      throw xml.fault(primitive.at, `<${name}> of ${of} has no input VERTEX`);
    }
  }
}

const isVertex = ({ attributes }: Element) => attributes["semantic"] === "VERTEX";

function known(xml: XmlText, input: Element, sources: Sources): Source {
  const { semantic, source = "" } = input.attributes;
  const found = sources.get(source.slice(1));
  if (!found) throw xml.fault(input.at, `the input ${semantic} names “${source}”, which is no <source> of its <mesh>`);
  return found;
}

const strideOf = (source: Element) => {
  const accessor = source.children.flatMap((one) => childrenOf(one, "accessor"))[0];
  return accessor ? Number(accessor.attributes["stride"] ?? 1) : 3;
};

function sourceOf(xml: XmlText, source: Element): Source {
  const array = child(source, "float_array");
  const words = wordsOf(array?.text ?? "");
  const said = array?.attributes["count"];
  if (array && said !== undefined && Number(said) !== words.length) {
    throw xml.fault(array.at, `the <float_array> “${idOf(array)}” says that it has ${said} numbers, and has ${words.length}`);
  }
  return { count: Math.floor(words.length / strideOf(source)) };
}

function checkPlaces(xml: XmlText, source: Element | undefined): void {
  if (!source) return; // said with its input
  const array = child(source, "float_array");
  if (!array) throw xml.fault(source.at, `the <source> “${idOf(source)}” has no <float_array>`);
  const words = wordsOf(array.text);
  const wrong = words.find((word) => !isNumber(word));
  if (wrong !== undefined) {
    const vertex = Math.floor(words.indexOf(wrong) / 3);
    throw xml.fault(
      array.at,
      `vertex ${vertex} of the <float_array> “${idOf(array)}” has “${wrong}”, which is no finite number`,
    );
  }
  const accessor = source.children.flatMap((one) => childrenOf(one, "accessor"))[0];
  const { stride, offset = "0" } = accessor?.attributes ?? { stride: "3" };
  if (Number(stride) !== 3 || Number(offset) !== 0) {
    throw xml.fault(
      accessor!.at,
      `the places “${idOf(source)}” have the stride ${stride ?? 1} and the offset ${offset}; this page reads 3 and 0`,
    );
  }
}

type Fault = (what: string, at?: number) => FileFault;

function checkFaces(xml: XmlText, faces: Element, of: string, vertices: Element, places: Source, sources: Sources): void {
  const { name } = faces;
  const fault: Fault = (what, at = faces.at) => xml.fault(at, `<${name}> of ${of} ${what}`);
  const said = faces.attributes["count"] ?? "";
  if (!/^\d+$/.test(said)) throw fault(`has the count “${said}”`);
  const count = Number(said);
  const list = onlyList(faces, fault);
  const inputs = checkedInputs(faces, vertices, fault);
  const stride = Math.max(...inputs.map(offsetOf)) + 1;
  const indices = indicesIn(xml, list);
  const corners = name === "triangles" ? undefined : cornersOf(xml, faces, indices.length / stride, fault);
  const polygonCount = corners?.length ?? count;
  if (polygonCount !== count) throw fault(`says that it has ${count} polygons, and has ${polygonCount}`);
  const wanted = stride * (corners ? corners.reduce((sum, one) => sum + one, 0) : 3 * count);
  if (wanted !== indices.length) {
    throw fault(`has ${count} polygons, for which <p> needs ${wanted} numbers; it has ${indices.length}`, list.at);
  }
  for (const input of inputs) {
    const limit = isVertex(input) ? places.count : known(xml, input, sources).count;
    for (let at = offsetOf(input); at < indices.length; at += stride) {
      if (indices[at]! < limit) continue;
      const polygon = polygonOf(corners, Math.floor(at / stride));
      const what = isVertex(input) ? "vertex" : input.attributes["semantic"];
      throw fault(`has a polygon ${polygon} with ${what} ${indices[at]}; there are ${limit}, counted from 0`, list.at);
    }
  }
}

/** The indices of all corners. */
function onlyList(faces: Element, fault: Fault): Element {
  const lists = childrenOf(faces, "p");
  if (child(faces, "ph")) throw fault("has a polygon with holes (<ph>), which this page does not read");
  if (faces.name === "polygons" && lists.length > 1) {
    throw fault(`has ${lists.length} polygons; this page reads one, or a <polylist>`);
  }
  if (lists.length !== 1) throw fault(`has ${lists.length} lists <p> in place of 1`);
  return lists[0]!;
}

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

function indicesIn(xml: XmlText, list: Element): number[] {
  const words = wordsOf(list.text);
  const wrong = words.find((word) => !/^\d+$/.test(word));
  if (wrong !== undefined) throw xml.fault(list.at, `<${list.name}> has “${wrong}”, which is no whole number from 0`);
  return words.map(Number);
}

/** How many corners each polygon of a <polylist> or <polygons> has. */
function cornersOf(xml: XmlText, faces: Element, all: number, fault: Fault): number[] {
  const list = child(faces, "vcount");
  if (faces.name === "polylist" && !list) throw fault("has no <vcount>");
  const corners = faces.name === "polygons" ? [Math.floor(all)] : indicesIn(xml, list!);
  const few = corners.findIndex((one) => one < 3);
  if (few >= 0) throw fault(`has a polygon ${few} with ${corners[few]} corners`, list?.at);
  return corners;
}

function polygonOf(corners: readonly number[] | undefined, corner: number): number {
  if (!corners) return Math.floor(corner / 3);
  let [polygon, end] = [0, corners[0] ?? 0];
  while (end <= corner) end += corners[++polygon]!;
  return polygon;
}
