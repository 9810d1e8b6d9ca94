import {
  Loader,
  LoadingManager,
  type Material,
  Mesh,
  MeshStandardMaterial,
  type MeshPhongMaterial,
  type Object3D,
} from "three";
import { FileFault } from "lpdeform-client/mesh/fault";
import { utf16Of } from "lpdeform-client/mesh/encodings";
import { checkDae } from "./dae_faults.js";
import { plainDae } from "./dae_plain.js";
import { withTriangles } from "./dae_triangles.js";
import { checkFbx } from "./fbx_faults.js";
import { check3mf } from "./threemf_faults.js";
import { checkUnpackedFbx, checkUnpackedZip } from "./unpacked.js";

// FBX, COLLADA and 3MF, as three.js reads them. They become a GLB, which is opened as any other, with names, colours, texture
// coordinates, skins and morph targets. Textures and animations are left out. Nothing that a file names is loaded from anywhere.

/** A GLB, and what the file had that is left out, in words. */
export interface Converted {
  glb: ArrayBuffer;
  left: readonly string[];
}

const kinds = { fbx: "FBX", dae: "COLLADA", "3mf": "3MF" } as const;
type Kind = keyof typeof kinds;

/** Needs XML: the page's, or that of worker_dom.ts. The reader of three.js is loaded with the first such file. Rejects with a FileFault. */
export async function glbIn(file: File): Promise<Converted> {
  const { name } = file;
  const kind = name.toLowerCase().split(".").at(-1) as Kind;
  const bytes = new Uint8Array(await file.arrayBuffer());
  try {
    const lost = new Set<string>();
    const scene = await quietly(() => readers[kind](name, bytes, lost));
    if (!hasTriangles(scene)) throw new FileFault(`${name} has no triangles${onlyLines(scene)}.`);
    const left = [...lost, ...checkedNumbers(name, scene), ...simplify(scene)];
    const { GLTFExporter } = await import("three/addons/exporters/GLTFExporter.js");
    const glb = await quietly(() => new GLTFExporter().parseAsync(scene, { binary: true, onlyVisible: false }));
    return { glb: glb as ArrayBuffer, left };
  } catch (error) {
    if (error instanceof FileFault) throw error;
    throw new FileFault(`${name} cannot be read as ${kinds[kind]}: ${whyOf(error as Error)}.`);
  }
}

/** `lost`: gets what is left out, in words. */
type Reader = (name: string, bytes: Uint8Array<ArrayBuffer>, lost: Set<string>) => Promise<Object3D>;

const readers: Record<Kind, Reader> = {
  async fbx(name, bytes) {
    await checkUnpackedFbx(bytes);
    checkFbx(name, bytes);
    const { FBXLoader } = await import("three/addons/loaders/FBXLoader.js");
    return new FBXLoader(nothingElse()).parse(bytes.buffer, "");
  },
  async dae(name, bytes, lost) {
    const { ColladaLoader } = await import("three/addons/loaders/ColladaLoader.js");
    const plain = plainDae(name, xmlText(bytes));
    const { text, left } = withTriangles(name, plain, checkDae(name, plain));
    if (left) lost.add(left);
    const read = new ColladaLoader(nothingElse()).parse(text, "");
    if (!read?.scene) throw new Error("its XML is broken");
    return read.scene;
  },
  async "3mf"(name, bytes) {
    await checkUnpackedZip(bytes);
    await check3mf(name, bytes);
    const { ThreeMFLoader } = await import("three/addons/loaders/3MFLoader.js");
    const scene = new ThreeMFLoader(nothingElse()).parse(bytes.buffer) as Object3D | null;
    if (!scene) throw new Error("its parts are not those of a 3MF file");
    scene.rotation.x = -Math.PI / 2; // 3MF has z up, and glTF y
    return scene;
  },
};

/** XML is in UTF-8, or in UTF-16 if it begins with the mark of that. */
function xmlText(bytes: Uint8Array): string {
  return new TextDecoder(utf16Of(bytes) ?? "utf-8").decode(bytes);
}

/** Every address that a file names is one without contents. */
function nothingElse(): LoadingManager {
  return new LoadingManager().setURLModifier(() => "data:,");
}

/** What the readers do not expect in a file is an error of the language, whose words are about their code. */
function whyOf(error: Error): string {
  if (error instanceof TypeError || error instanceof RangeError) return "parts of it are missing or damaged";
  return error.message.replace(/^THREE\.\w+: /, "").replace(/\.+$/, "") || "it ends too soon";
}

let readings = 0;
let loud: Pick<Console, "warn" | "error" | "log">;

/** The readers tell the console what they do not know; what they cannot read they throw, or return nothing. */
async function quietly<Value>(read: () => Promise<Value>): Promise<Value> {
  if (readings++ === 0) {
    const { warn, error, log } = console;
    loud = { warn, error, log };
    console.warn = console.error = console.log = () => undefined;
  }
  try {
    return await read();
  } finally {
    if (--readings === 0) Object.assign(console, loud);
  }
}

function hasTriangles(scene: Object3D): boolean {
  let most = 0;
  scene.traverse((object) => {
    if (!(object instanceof Mesh)) return;
    const { index, attributes } = (object as Mesh).geometry;
    most = Math.max(most, index?.count ?? attributes["position"]?.count ?? 0);
  });
  return most >= 3;
}

/** What the scene has in place of triangles. */
function onlyLines(scene: Object3D): string {
  const names: string[] = [];
  scene.traverse((object) => {
    if ("isLine" in object) names.push(`“${calledIn(object)}”`);
  });
  return names.length > 0 ? `, only the lines ${names.join(", ")}` : "";
}

/** A name that the file has: of the object, or of one in which it stands. */
function calledIn(object: Object3D): string {
  return object.name || (object.parent ? calledIn(object.parent) : "");
}

/** Attributes of vertices that can be left out, in words. */
const dispensable: readonly (readonly [RegExp, string])[] = [
  [/^normal$/, "normals"],
  [/^tangent$/, "tangents"],
  [/^uv\d*$/, "texture coordinates"],
  [/^color$/, "colours"],
];

const isFinite = ({ array }: { array: ArrayLike<number> }) => Array.prototype.every.call(array, Number.isFinite);

/** Leaves out what is no number and can be spared, and returns what that is. Throws a FileFault for all else. */
function checkedNumbers(name: string, scene: Object3D): readonly string[] {
  const left = new Set<string>();
  scene.updateMatrixWorld(true);
  scene.traverse((object) => {
    const fault = (what: string) => new FileFault(`${name}: “${calledIn(object)}” has ${what} that is no finite number.`);
    if (!object.matrixWorld.elements.every(Number.isFinite)) throw fault("a place, a turn or a size");
    if (!(object instanceof Mesh)) return;
    const { geometry } = object as Mesh;
    for (const [key, attribute] of Object.entries(geometry.attributes)) {
      if (isFinite(attribute)) continue;
      const found = dispensable.find(([pattern]) => pattern.test(key));
      if (!found) throw fault(`a value “${key}” of a vertex`);
      geometry.deleteAttribute(key);
      left.add(`${found[1]} that are no numbers`);
    }
    if (!Object.values(geometry.morphAttributes).flat().every(isFinite)) throw fault("a value of a morph target");
  });
  return [...left];
}

/** Leaves plain colours of the materials, and no animations. Returns what is gone. */
function simplify(scene: Object3D): readonly string[] {
  const left = new Set<string>();
  const plain = (material: Material) => {
    const { name, color, opacity, transparent, side } = material as MeshPhongMaterial;
    if (Object.values(material).some((value) => value?.isTexture)) left.add("textures");
    const isNone = name === Loader.DEFAULT_MATERIAL_NAME; // which the reader of COLLADA makes pink
    return new MeshStandardMaterial({
      name: isNone ? "" : name,
      ...(color && !isNone && { color }),
      opacity,
      transparent,
      side,
    });
  };
  scene.traverse((object) => {
    if (object.animations.length > 0) left.add("animations");
    object.animations = [];
    if (!(object instanceof Mesh)) return;
    const mesh = object as Mesh;
    mesh.material = Array.isArray(mesh.material) ? mesh.material.map(plain) : plain(mesh.material);
  });
  return [...left];
}
