import { type Faces, isFaces, isVertex, readFaces, type Source } from "./dae_polygons.js";
import { checkCopies, type Use } from "./uses.js";
import { child, childrenOf, type Element, elementsIn, isNumber, wordsOf, XmlText } from "./xml.js";

// What a COLLADA file has that the reader of three.js would leave out or tear without a word is refused by its line. Everything counts
// from 0, as the file does.

const lineKinds = ["lines", "linestrips"];
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

/** The faces of a mesh, all of which can be shown. */
export interface DaeMesh {
  xml: XmlText;
  /** In words. */
  called: string;
  /** x, y, z of each vertex. */
  places: readonly number[];
  faces: readonly Faces[];
}

/** Returns the meshes. Throws a FileFault. */
export function checkDae(name: string, text: string): DaeMesh[] {
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
  const meshes: DaeMesh[] = [];
  for (const element of all) {
    checkNumbers(xml, element);
    checkReference(xml, element, named);
    const mesh = element.name === "geometry" ? child(element, "mesh") : undefined;
    if (mesh) meshes.push(checkedMesh(xml, mesh, `the geometry “${idOf(element)}”`));
  }
  const uses = all.flatMap((element) => (element.name === "node" ? usesIn(xml, element) : []));
  const copies = uses.filter(({ name }) => name === "instance_node");
  checkCopies("node", uses, copies);
  return meshes;
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

type Sources = ReadonlyMap<string | undefined, Source>;

function checkedMesh(xml: XmlText, mesh: Element, called: string): DaeMesh {
  const sources = new Map(childrenOf(mesh, "source").map((source) => [source.attributes["id"], sourceOf(xml, source)]));
  const vertices = child(mesh, "vertices");
  const position = vertices && childrenOf(vertices, "input").find(({ attributes }) => attributes["semantic"] === "POSITION");
  if (!vertices || !position) throw xml.fault(mesh.at, `${called} has no <vertices> with a POSITION`);
  const places = placesIn(
    xml,
    childrenOf(mesh, "source").find((source) => `#${source.attributes["id"]}` === position.attributes["source"]),
  );
  for (const input of childrenOf(vertices, "input")) known(xml, input, sources);
  const sourceOfInput = (input: Element) => known(xml, isVertex(input) ? position : input, sources);
  const faces: Faces[] = [];
  for (const primitive of mesh.children) {
    const { name } = primitive;
    if (isFaces(primitive)) faces.push(readFaces(xml, primitive, called, vertices, sourceOfInput));
    if (lineKinds.includes(name) && !childrenOf(primitive, "input").some(isVertex)) {
      throw xml.fault(primitive.at, `<${name}> of ${called} has no input VERTEX`);
    }
  }
  return { xml, called, places, faces };
}

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
  const stride = strideOf(source);
  return { count: Math.floor(words.length / stride), stride };
}

function placesIn(xml: XmlText, source: Element | undefined): number[] {
  if (!source) return []; // said with its input
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
  return words.map(Number);
}
