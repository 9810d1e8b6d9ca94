import type { Texturing, TextureLayer } from "../model/texturing.js";
import { readNumbers } from "lpdeform-client/mesh/gltf_accessors";
import { type Block, type DrawPart, readBlocks } from "lpdeform-client/mesh/gltf_blocks";
import {
  bytesAt,
  type GltfDocument,
  indexOf,
  listOf,
  nameOf,
  type Part,
  partOf,
  readGltfDocument,
} from "lpdeform-client/mesh/gltf_document";

const clampToEdge = 33071;

/** The base colours of what readGltf() reads of the same file: images, and the colours that they are multiplied by. */
export function readGltfTextures(name: string, bytes: Uint8Array): Texturing {
  const document = readGltfDocument(name, bytes, new Map());
  const { parts, faces, vertexCount } = readBlocks(document);
  const places = new Places(document, vertexCount);
  const images = new Map<number, Blob | undefined>();
  const corners = Uint32Array.from(faces);
  const layers = parts.map((part) => {
    const material = materialOf(document.json, part);
    const texture = partOf(material["baseColorTexture"]);
    const layer = layerOf(document.json, part, material, texture);
    const accessor = coordinatesOf(document.json, part, texture);
    if (accessor === undefined) return layer;
    const moved = places.of(part.block, accessor) - part.block.first;
    const end = 3 * (part.firstFace + part.faceCount);
    for (let corner = 3 * part.firstFace; moved > 0 && corner < end; ++corner) corners[corner]! += moved;
    const index = sourceOf(document.json, texture);
    if (!images.has(index)) images.set(index, imageOf(document, index));
    const image = images.get(index);
    return { ...layer, ...(image && { image }) };
  });
  return { coordinates: places.coordinates, corners, layers };
}

/**
 * Places in images, as accessors have them. A block's are where its vertices are, unless its primitives have several accessors: those
 * of the second and later ones are behind all vertices.
 */
class Places {
  readonly #firsts = new Map<Block, Map<number, number>>();
  readonly #pieces: { first: number; numbers: Float64Array }[] = [];
  #count: number;

  constructor(
    readonly document: GltfDocument,
    vertexCount: number,
  ) {
    this.#count = vertexCount;
  }

  /** Where those of the block begin. */
  of(block: Block, accessor: number): number {
    const firsts = this.#firsts.get(block) ?? new Map<number, number>();
    this.#firsts.set(block, firsts);
    const known = firsts.get(accessor);
    if (known !== undefined) return known;
    const first = firsts.size === 0 ? block.first : this.#count;
    const numbers = readNumbers(this.document, accessor, 2).subarray(0, 2 * block.count);
    if (firsts.size > 0) this.#count += block.count;
    firsts.set(accessor, first);
    this.#pieces.push({ first, numbers });
    return first;
  }

  get coordinates(): Float32Array {
    const all = new Float32Array(2 * this.#count);
    for (const { first, numbers } of this.#pieces) all.set(numbers, 2 * first);
    return all;
  }
}

function primitiveOf(json: Part, { block, primitive }: DrawPart): Part {
  return listOf(listOf(json, "meshes")[block.mesh]!, "primitives")[primitive]!;
}

/** Of “pbrMetallicRoughness”. */
function materialOf(json: Part, part: DrawPart): Part {
  const { material } = primitiveOf(json, part);
  if (material === undefined) return {};
  const owner = nameOf(json, "meshes", part.block.mesh);
  return partOf(listOf(json, "materials")[indexOf(json, material, "materials", owner)]!["pbrMetallicRoughness"]);
}

function layerOf(json: Part, { firstFace, faceCount }: DrawPart, material: Part, texture: Part): TextureLayer {
  const factor = material["baseColorFactor"];
  const isColour = Array.isArray(factor) && factor.length === 4 && factor.every((value) => value >= 0 && value <= 1);
  const [r, g, b] = isColour ? (factor as [number, number, number]) : [1, 1, 1];
  const { sampler } = partOf(listOf(json, "textures")[texture["index"] as number]);
  const { wrapS } = partOf(listOf(json, "samplers")[sampler as number]);
  return { firstFace, faceCount, colour: [r, g, b], isRepeated: wrapS !== clampToEdge };
}

/** The accessor of the places in the image of the part's vertices, if they have any. */
function coordinatesOf(json: Part, part: DrawPart, texture: Part): number | undefined {
  if (texture["index"] === undefined) return undefined;
  const key = `TEXCOORD_${Number(texture["texCoord"] ?? 0)}`;
  const accessor = partOf(primitiveOf(json, part)["attributes"])[key];
  if (accessor === undefined) return undefined;
  return indexOf(json, accessor, "accessors", nameOf(json, "meshes", part.block.mesh));
}

/** The number of the texture's image. */
function sourceOf(json: Part, texture: Part): number {
  const { source, extensions } = partOf(listOf(json, "textures")[texture["index"] as number]);
  const webp = partOf(partOf(extensions)["EXT_texture_webp"])["source"];
  return (webp ?? source) as number;
}

/** Undefined if it is not in the file. */
function imageOf({ json, buffer }: GltfDocument, index: number): Blob | undefined {
  const image = partOf(listOf(json, "images")[index]);
  const view = partOf(listOf(json, "bufferViews")[image["bufferView"] as number]);
  const { byteOffset = 0, byteLength = 0 } = view as { byteOffset?: number; byteLength?: number };
  const bytes =
    image["bufferView"] === undefined ? bytesAt(image["uri"], new Map()) : buffer.subarray(byteOffset, byteOffset + byteLength);
  return bytes && new Blob([bytes as Uint8Array<ArrayBuffer>]);
}
