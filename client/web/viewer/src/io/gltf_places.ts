import { float, type Layout, layoutOf } from "lpdeform-client/mesh/gltf_accessors";
import type { Block } from "lpdeform-client/mesh/gltf_blocks";
import { type GltfDocument, listOf, type Part, partOf } from "lpdeform-client/mesh/gltf_document";

const changed = ["POSITION", "NORMAL", "TANGENT"];
const accessorKeys = ["indices", "inverseBindMatrices", "input", "output", "accessor"];

const overlap = (begin: number, end: number, other: number, otherEnd: number) => begin < otherEnd && other < end;

/** Interleaved accessors have one stride, and different places within it. */
function shareBytes(a: Layout, b: Layout): boolean {
  if (!overlap(a.begin, a.end, b.begin, b.end)) return false;
  if (a.stride !== b.stride) return true;
  const gap = (((b.begin - a.begin) % a.stride) + a.stride) % a.stride;
  return gap < a.size || gap + b.size > a.stride;
}

/** Tells where new values may lie in a file of which everything else must stay as it is. */
export class Places {
  readonly #meshesElsewhere = new Set<number>();
  readonly #usedElsewhere = new Set<number>();
  readonly #otherViews = new Set<number>();
  readonly #taken = new Set<number>();

  /** `document` is not changed while this lives. */
  constructor(
    readonly document: GltfDocument,
    blocks: readonly Block[],
  ) {
    const { json } = document;
    const drawing = new Set(blocks.map(({ node }) => node));
    listOf(json, "nodes").forEach((node, k) => {
      if (typeof node["mesh"] === "number" && !drawing.has(k)) this.#meshesElsewhere.add(node["mesh"]);
    });
    const rest = structuredClone(json);
    for (const accessor of listOf(rest, "accessors")) delete accessor["bufferView"];
    for (const { mesh, primitives } of blocks.filter((block) => !this.isMeshElsewhere(block.mesh))) {
      const all = listOf(listOf(rest, "meshes")[mesh]!, "primitives");
      for (const primitive of primitives) for (const key of changed) delete partOf(all[primitive]!["attributes"])[key];
    }
    this.#findUses(rest);
  }

  /** Whether something that is no block draws the mesh as well. */
  isMeshElsewhere(mesh: number): boolean {
    return this.#meshesElsewhere.has(mesh);
  }

  /** Whether new floats may overwrite the accessor's: nothing but blocks uses it, the first of which asks now. */
  take(accessor: number): boolean {
    if (this.#usedElsewhere.has(accessor) || this.#taken.has(accessor) || !this.#hasBytesAlone(accessor)) return false;
    this.#taken.add(accessor);
    return true;
  }

  #findUses(value: unknown): void {
    if (typeof value !== "object" || value === null) return;
    const use = (accessor: unknown) => void (typeof accessor === "number" && this.#usedElsewhere.add(accessor));
    for (const [key, inner] of Object.entries(value as Part)) {
      if (key === "bufferView" && typeof inner === "number") this.#otherViews.add(inner);
      if (accessorKeys.includes(key)) use(inner);
      if (key === "attributes") Object.values(partOf(inner)).forEach(use);
      if (key === "targets" && Array.isArray(inner)) for (const target of inner) Object.values(partOf(target)).forEach(use);
      this.#findUses(inner);
    }
  }

  #hasBytesAlone(accessor: number): boolean {
    const accessors = listOf(this.document.json, "accessors");
    const object = accessors[accessor]!;
    if (object["componentType"] !== float || object["sparse"] !== undefined) return false;
    const own = layoutOf(this.document, accessor);
    const isAlone = listOf(this.document.json, "bufferViews").every((view, k) => {
      const begin = (view["byteOffset"] ?? 0) as number;
      if (!overlap(own.begin, own.end, begin, begin + (view["byteLength"] as number))) return true;
      return k === object["bufferView"] && !this.#otherViews.has(k);
    });
    const shares = (other: Part, k: number) =>
      k !== accessor && other["bufferView"] === object["bufferView"] && shareBytes(own, layoutOf(this.document, k));
    return isAlone && !accessors.some(shares);
  }
}
