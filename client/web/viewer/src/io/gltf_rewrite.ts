import { usualWelding } from "lpdeform-client/mesh/derived";
import { Matrix3, Matrix4, Vector3 } from "three";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { seamsOf } from "lpdeform-client/mesh/seams";
import { boundsOf } from "./write_glb.js";
import { float, layoutOf, readNumbers } from "lpdeform-client/mesh/gltf_accessors";
import { type Block, readBlocks } from "lpdeform-client/mesh/gltf_blocks";
import {
  appendView,
  type GltfDocument,
  listOf,
  type Part,
  partOf,
  readGltfDocument,
  viewOf,
  writeGlb,
} from "lpdeform-client/mesh/gltf_document";
import { Places } from "./gltf_places.js";
import { type Numbers, NormalTurner } from "./turned_normals.js";

const sameNormal = Math.cos(Math.PI / 180);
/** Single precision rounds a direction by less. */
const sameDirection = 1e-6;

/**
 * The GLB with new positions, and with normals and tangents turned as the surface turns. Values lie where they lay, if nothing
 * else uses those bytes, and otherwise in accessors that are added; meshes that several nodes draw are parted. Everything else
 * stays as it is, to the bit.
 */
export function rewriteGlb(mesh: Mesh & { gltf: Uint8Array }, positions: Numbers): Uint8Array<ArrayBuffer> {
  return new Rewriter(mesh, positions).write();
}

class Rewriter {
  readonly #source: GltfDocument;
  readonly #out: GltfDocument;
  readonly #blocks: readonly Block[];
  readonly #places: Places;
  readonly #meshOfNode = new Map<number, number>();
  readonly #rest: Numbers;
  #turner!: NormalTurner;
  #smooth!: Uint32Array;

  constructor(
    readonly mesh: Mesh & { gltf: Uint8Array },
    readonly positions: Numbers,
  ) {
    this.#source = readGltfDocument(mesh.name, mesh.gltf, new Map());
    this.#out = { ...this.#source, json: structuredClone(this.#source.json), buffer: this.#source.buffer.slice() };
    this.#blocks = readBlocks(this.#source).blocks;
    this.#places = new Places(this.#source, this.#blocks);
    this.#rest = mesh.exact ?? mesh.positions;
  }

  write(): Uint8Array<ArrayBuffer> {
    const normals = this.#normalsAtRest();
    this.#smooth = smoothGroups(this.mesh, normals);
    this.#turner = new NormalTurner(
      this.#rest,
      this.positions,
      this.mesh.faces.map((vertex) => this.#smooth[vertex]!),
    );
    const touched = new Set(this.#blocks.filter((block) => this.#hasMoved(block)).flatMap(accessorsOf));
    for (const block of this.#blocks) {
      if (!accessorsOf(block).some((accessor) => touched.has(accessor))) continue;
      this.#put(block, "POSITION", block.position, this.#newPositions(block), 3);
      const { normal, tangent } = block;
      const toWorld = new Matrix3().setFromMatrix4(matrixOf(block));
      const toNormal = toWorld.clone().invert().transpose();
      if (normal !== undefined) this.#put(block, "NORMAL", normal, this.#turned(block, normal, 3, toNormal), 3);
      if (tangent !== undefined) this.#put(block, "TANGENT", tangent, this.#turned(block, tangent, 4, toWorld), 4);
    }
    return writeGlb(this.#out);
  }

  #hasMoved({ first, count }: Block): boolean {
    for (let k = 3 * first; k < 3 * (first + count); ++k) if (this.positions[k] !== this.#rest[k]) return true;
    return false;
  }

  /** Where the blocks draw them; 0 where there are none. */
  #normalsAtRest(): Float64Array {
    const all = new Float64Array(this.#rest.length);
    const normal = new Vector3();
    for (const block of this.#blocks.filter((one) => one.normal !== undefined)) {
      const toWorld = new Matrix3().getNormalMatrix(matrixOf(block));
      const local = readNumbers(this.#source, block.normal!, 3);
      for (let k = 0; k < local.length; k += 3) {
        normal.fromArray(local, k).applyMatrix3(toWorld).normalize();
        normal.toArray(all, 3 * block.first + k);
      }
    }
    return all;
  }

  #newPositions(block: Block): Float32Array {
    const { position, first } = block;
    const values = Float32Array.from(readNumbers(this.#source, position, 3));
    const toLocal = matrixOf(block).invert();
    const place = new Vector3();
    for (let k = 0; k < values.length; k += 3) {
      const at = 3 * first + k;
      if ([0, 1, 2].every((axis) => this.positions[at + axis] === this.#rest[at + axis])) continue;
      place.fromArray(this.positions, at).applyMatrix4(toLocal).toArray(values, k);
    }
    return values;
  }

  /** The directions of an attribute, turned as the surface turns. A tangent's fourth number stays. */
  #turned({ first }: Block, accessor: number, width: number, toWorld: Matrix3): Float32Array {
    const values = Float32Array.from(readNumbers(this.#source, accessor, width));
    const toLocal = toWorld.clone().invert();
    const [before, after] = [new Vector3(), new Vector3()];
    for (let k = 0; k * width < values.length; ++k) {
      before.fromArray(values, k * width).normalize();
      after.copy(before).applyMatrix3(toWorld);
      after
        .fromArray(this.#turner.turned(this.#smooth[first + k]!, after.toArray()))
        .applyMatrix3(toLocal)
        .normalize();
      if (after.lengthSq() > 0 && after.distanceTo(before) > sameDirection) after.toArray(values, k * width);
    }
    return values;
  }

  #put(block: Block, key: string, accessor: number, values: Float32Array, width: number): void {
    const accessors = listOf(this.#out.json, "accessors");
    if (this.#places.take(accessor)) {
      const { begin, stride } = layoutOf(this.#source, accessor);
      const view = viewOf(this.#out.buffer);
      values.forEach((value, k) => view.setFloat32(begin + Math.floor(k / width) * stride + 4 * (k % width), value, true));
      setBounds(accessors[accessor]!, key, values, width);
      return;
    }
    const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
    const added: Part = {
      bufferView: appendView(this.#out, bytes, 34962),
      componentType: float,
      count: values.length / width,
      type: `VEC${width}`,
    };
    setBounds(added, key, values, width);
    const number = accessors.push(added) - 1;
    const primitives = listOf(listOf(this.#out.json, "meshes")[this.#ownMesh(block)]!, "primitives");
    for (const primitive of block.primitives) partOf(primitives[primitive]!["attributes"])[key] = number;
  }

  /** The mesh that the block's node alone draws: a copy, unless the node is the first and only blocks draw it. */
  #ownMesh({ node, mesh }: Block): number {
    let own = this.#meshOfNode.get(node);
    if (own !== undefined) return own;
    const first = this.#blocks.find((block) => block.mesh === mesh)!;
    own = mesh;
    if (first.node !== node || this.#places.isMeshElsewhere(mesh)) {
      own = listOf(this.#out.json, "meshes").push(structuredClone(listOf(this.#source.json, "meshes")[mesh]!)) - 1;
      listOf(this.#out.json, "nodes")[node]!["mesh"] = own;
    }
    this.#meshOfNode.set(node, own);
    return own;
  }
}

function accessorsOf({ position, normal, tangent }: Block): number[] {
  return [position, normal, tangent].filter((accessor) => accessor !== undefined);
}

/** Positions must have “min” and “max”; other accessors may. */
function setBounds(accessor: Part, key: string, values: Float32Array, width: number): void {
  if (values.length === 0 || (key !== "POSITION" && accessor["min"] === undefined)) return;
  Object.assign(accessor, boundsOf(values, width));
}

/**
 * For each vertex one that stands for it: the first in the same place whose normal is the same to within a degree. So both sides of
 * a seam turn alike, and each side of a hard edge follows its own faces.
 */
function smoothGroups(mesh: Mesh, normals: Float64Array): Uint32Array {
  const places = seamsOf(mesh, usualWelding.tolerance)?.groups;
  const known = new Map<number, number[]>();
  const isSame = (a: number, b: number) => {
    const cosine = [0, 1, 2].reduce((sum, axis) => sum + normals[3 * a + axis]! * normals[3 * b + axis]!, 0);
    return cosine >= sameNormal || (isNone(a) && isNone(b));
  };
  const isNone = (v: number) => normals[3 * v] === 0 && normals[3 * v + 1] === 0 && normals[3 * v + 2] === 0;
  return Uint32Array.from({ length: normals.length / 3 }, (_, vertex) => {
    if (!places) return vertex;
    const here = known.get(places[vertex]!) ?? [];
    const same = here.find((other) => isSame(vertex, other));
    if (same !== undefined) return same;
    known.set(places[vertex]!, [...here, vertex]);
    return vertex;
  });
}

function matrixOf({ placement }: Block): Matrix4 {
  return new Matrix4().fromArray(placement);
}
