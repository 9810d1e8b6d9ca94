import { mat4, quat, type vec3 } from "gl-matrix";
import { countOf, readNumbers } from "./gltf_accessors.js";
import {
  type GltfDocument,
  indexOf,
  listOf,
  nameOf,
  type Part,
  partOf,
  quoted,
  refuse,
  wholeOf,
} from "./gltf_document.js";

/** Sixteen doubles, column by column. */
export type Placement = number[];

/** Vertices that one node draws: the elements of one set of accessors, which several primitives of its mesh may share. */
export interface Block {
  node: number;
  mesh: number;
  primitives: number[];
  position: number;
  normal: number | undefined;
  tangent: number | undefined;
  /** From the mesh's coordinates to where it is drawn. */
  placement: Placement;
  /** Its vertices in the mesh of all blocks. */
  first: number;
  count: number;
}

/** What the scene draws as triangles. */
export interface DrawList {
  blocks: Block[];
  vertexCount: number;
  /** Three vertices of all blocks each. */
  faces: number[];
  /** Which primitive the faces are of, in their order. */
  parts: DrawPart[];
  /** What is drawn otherwise, in words. */
  left: Set<string>;
  /** The same part by part, a sentence each. */
  notices: Set<string>;
}

/** The faces of one primitive. */
export interface DrawPart {
  block: Block;
  primitive: number;
  firstFace: number;
  faceCount: number;
}

const identity: Placement = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const [triangles, strip, fan] = [4, 5, 6];
const most = 5_000_000;

/** As the command line reads it (core/gltf/gltf.h). Throws a FileFault that names the part. */
export function readBlocks(document: GltfDocument): DrawList {
  const { json } = document;
  const required = requiredOf(json);
  checkExtensions(required.filter((name) => !isCompression(name)));
  listOf(json, "bufferViews").forEach((view, k) => {
    const extensions = partOf(view["extensions"]);
    const name = ["EXT_meshopt_compression", "KHR_meshopt_compression"].find((key) => key in extensions);
    if (name) refuse(nameOf(json, "bufferViews", k), `is compressed by ${name}, which is not read`);
  });
  const list: DrawList = { blocks: [], vertexCount: 0, faces: [], parts: [], left: new Set(), notices: new Set() };
  const worlds = nodesOf(json);
  for (const node of worlds.keys()) {
    if (listOf(json, "nodes")[node]!["mesh"] !== undefined) readNode(document, node, worlds, list);
  }
  checkExtensions(required); // a compression is refused by what it compresses, if the scene draws that
  const others = list.left.size > 0 ? `, only ${[...list.left].join(", ")}` : "";
  if (list.faces.length === 0) refuse("the scene", `has no triangles that could be deformed${others}`);
  return list;
}

function requiredOf(json: Part): string[] {
  const required = json["extensionsRequired"] ?? [];
  if (!Array.isArray(required)) refuse("“extensionsRequired”", "is no list");
  if (!required.every((name) => typeof name === "string"))
    refuse("“extensionsRequired”", "has an item that is no text");
  return required as string[];
}

const isCompression = (extension: string) => /^KHR_draco_mesh_compression$|_meshopt_compression$/.test(extension);

/** Extensions that leave the places of vertices alone; all else that is required could move them. */
const harmless = /_materials_|_texture_|_lights_|_animation_|_audio|_xmp|KHR_mesh_quantization/;

function checkExtensions(required: readonly string[]): void {
  const unknown = required.find((name) => !harmless.test(name));
  if (unknown !== undefined) refuse(`the extension ${quoted(unknown)}`, "is required by the file and not known here");
}

/** The nodes of the scene, each before its children, with their transforms. */
function nodesOf(json: Part): Map<number, Placement> {
  const nodes = listOf(json, "nodes");
  const childrenOf = (part: Part, key: string, name: string) => {
    const children = part[key] ?? [];
    if (!Array.isArray(children)) refuse(name, `has “${key}” that are no list`);
    return children.map((child) => indexOf(json, child, "nodes", name));
  };
  const scenes = listOf(json, "scenes");
  const scene = scenes.length > 0 ? indexOf(json, json["scene"] ?? 0, "scenes", "the file") : -1;
  const inner = new Set(nodes.flatMap((node, k) => childrenOf(node, "children", nameOf(json, "nodes", k))));
  const roots =
    scene >= 0 ? childrenOf(scenes[scene]!, "nodes", `scene ${scene}`) : [...nodes.keys()].filter((k) => !inner.has(k));
  const found = new Map<number, Placement>();
  const open = roots.map((node) => [node, identity] as const).reverse();
  for (let next = open.pop(); next; next = open.pop()) {
    const [node, above] = next;
    const name = nameOf(json, "nodes", node);
    if (found.has(node)) refuse(name, "is reached twice: nodes must be trees");
    const toWorld = product(above, ownTransform(nodes[node]!, name));
    found.set(node, toWorld);
    for (const child of childrenOf(nodes[node]!, "children", name).reverse()) open.push([child, toWorld]);
  }
  return found;
}

function product(a: Placement, b: Placement): Placement {
  return mat4.multiply([...identity] as mat4, a as mat4, b as mat4) as Placement;
}

function ownTransform(node: Part, name: string): Placement {
  const numbers = (key: string, otherwise: readonly number[]) => {
    const list = node[key] ?? otherwise;
    const isRight = Array.isArray(list) && list.length === otherwise.length && list.every(Number.isFinite);
    return isRight ? (list as number[]) : refuse(name, `has a “${key}” that is no list of ${otherwise.length} numbers`);
  };
  if (node["matrix"] !== undefined) return numbers("matrix", identity);
  const [translation, rotation, scale] = [
    numbers("translation", [0, 0, 0]),
    numbers("rotation", [0, 0, 0, 1]),
    numbers("scale", [1, 1, 1]),
  ];
  const turn = quat.normalize([0, 0, 0, 1], rotation as quat);
  return mat4.fromRotationTranslationScale(
    [...identity] as mat4,
    turn,
    translation as vec3,
    scale as vec3,
  ) as Placement;
}

/** A mesh with a skin stands where its joints place it if they all agree, as in the pose of binding. */
function skinPlacement(document: GltfDocument, node: Part, worlds: Map<number, Placement>, name: string): Placement {
  const { json } = document;
  const skin = listOf(json, "skins")[indexOf(json, node["skin"], "skins", name)]!;
  const joints = Array.isArray(skin["joints"]) ? (skin["joints"] as unknown[]) : [];
  const accessor = skin["inverseBindMatrices"];
  const inverse =
    accessor === undefined ? undefined : readNumbers(document, indexOf(json, accessor, "accessors", name), 16);
  const placed = joints.map((joint, k) => {
    const bind = inverse && inverse.length >= 16 * (k + 1) ? [...inverse.subarray(16 * k, 16 * (k + 1))] : identity;
    return product(worlds.get(joint as number) ?? identity, bind);
  });
  const [first] = placed;
  const size = Math.hypot(...(first ?? [0]));
  const areSame = placed.every((one) => one.every((value, k) => Math.abs(value - first![k]!) <= 1e-3 * size));
  return first && areSame ? first : identity;
}

function readNode(document: GltfDocument, node: number, worlds: Map<number, Placement>, list: DrawList): void {
  const { json } = document;
  const object = listOf(json, "nodes")[node]!;
  const name = nameOf(json, "nodes", node);
  if (partOf(object["extensions"])["EXT_mesh_gpu_instancing"])
    refuse(name, "draws by EXT_mesh_gpu_instancing, which is not read");
  const mesh = indexOf(json, object["mesh"], "meshes", name);
  const placement = object["skin"] === undefined ? worlds.get(node)! : skinPlacement(document, object, worlds, name);
  const size = Math.hypot(...placement.slice(0, 11));
  if (!(Math.abs(mat4.determinant(placement as mat4)) > 1e-12 * size ** 3)) {
    list.left.add(`what ${name} draws, which its scale flattens`);
    list.notices.add(`What ${name} draws is flattened by its scale, and stays as it is.`);
    return;
  }
  const primitives = listOf(listOf(json, "meshes")[mesh]!, "primitives");
  const own = new Map<string, Block>(); // by its accessors
  primitives.forEach((primitive, k) => {
    const part = `primitive ${k} of ${nameOf(json, "meshes", mesh)}`;
    if (partOf(primitive["extensions"])["KHR_draco_mesh_compression"]) {
      refuse(part, "is compressed by KHR_draco_mesh_compression, which is not read");
    }
    const mode = wholeOf(primitive, "mode", triangles, part);
    const attributes = partOf(primitive["attributes"]);
    const accessor = (key: string) =>
      attributes[key] === undefined ? undefined : indexOf(json, attributes[key], "accessors", part);
    const [position, normal, tangent] = [accessor("POSITION"), accessor("NORMAL"), accessor("TANGENT")];
    if (![triangles, strip, fan].includes(mode)) {
      list.left.add("points and lines");
      list.notices.add(`The ${mode === 0 ? "points" : "lines"} of ${part} stay as they are.`);
      return;
    }
    if (position === undefined) {
      list.left.add("primitives without positions");
      list.notices.add(`There are no positions in ${part}: it stays as it is.`);
      return;
    }
    const key = [position, normal, tangent].join();
    let block = own.get(key);
    if (block) block.primitives.push(k);
    else {
      const count = countOf(document, position);
      if (normal !== undefined && countOf(document, normal) !== count)
        refuse(part, "has attributes of different lengths");
      if (tangent !== undefined && countOf(document, tangent) !== count)
        refuse(part, "has attributes of different lengths");
      block = { node, mesh, primitives: [k], position, normal, tangent, placement, first: list.vertexCount, count };
      own.set(key, block);
      list.vertexCount += count;
      if (list.vertexCount > most) refuse("the scene", `has more than ${most} vertices, which this page takes at most`);
    }
    const firstFace = list.faces.length / 3;
    const corners = cornersOf(document, primitive, block.count, part);
    addTriangles(corners, mode, block, list);
    const { length } = corners;
    const rest = mode === triangles ? length % 3 : length < 3 ? length : 0;
    if (rest > 0) list.notices.add(`Corners at the end of ${part} make no triangle: ${rest} of ${length}.`);
    list.parts.push({ block, primitive: k, firstFace, faceCount: list.faces.length / 3 - firstFace });
  });
  for (const block of own.values()) list.blocks.push(block);
}

function cornersOf(document: GltfDocument, primitive: Part, count: number, part: string): ArrayLike<number> {
  if (primitive["indices"] === undefined) return Array.from({ length: count }, (_, k) => k);
  const corners = readNumbers(document, indexOf(document.json, primitive["indices"], "accessors", part), 1);
  const wrong = corners.findIndex((corner) => !(Number.isInteger(corner) && corner >= 0 && corner < count));
  if (wrong >= 0) refuse(part, `names by index ${wrong} vertex ${corners[wrong]} of ${count}`);
  return corners;
}

function addTriangles(
  corners: ArrayLike<number>,
  mode: number,
  { placement, first }: Block,
  { faces }: DrawList,
): void {
  const isMirrored = mat4.determinant(placement as mat4) < 0;
  for (let k = 0; k + 2 < corners.length; k += mode === triangles ? 3 : 1) {
    const [a, b, c] = [corners[mode === fan ? 0 : k]!, corners[k + 1]!, corners[k + 2]!];
    if (mode !== triangles && (a === b || b === c || c === a)) continue; // strips are joined by such triangles
    const isTurned = isMirrored !== (mode === strip && k % 2 === 1);
    faces.push(first + a, first + (isTurned ? c : b), first + (isTurned ? b : c));
  }
  if (faces.length > 3 * most) refuse("the scene", `has more than ${most} triangles, which this page takes at most`);
}
