import type { Texturing, TextureLayer } from "../model/texturing.js";
import { readNumbers } from "./gltf_accessors.js";
import { type DrawPart, readBlocks } from "./gltf_blocks.js";
import { bytesAt, type GltfDocument, indexOf, listOf, nameOf, type Part, partOf, readGltfDocument } from "./gltf_document.js";

const clampToEdge = 33071;

/** The base colours of what readGltf() reads of the same file: images, and the colours that they are multiplied by. */
export function readGltfTextures(name: string, bytes: Uint8Array): Texturing {
  const document = readGltfDocument(name, bytes, new Map());
  const { parts, faces, vertexCount } = readBlocks(document);
  const coordinates = new Float32Array(2 * vertexCount);
  const layers = parts.map((part) => {
    const material = materialOf(document.json, part);
    const texture = partOf(material["baseColorTexture"]);
    const has = takeCoordinates(document, part, texture, coordinates);
    const image = has ? imageOf(document, texture) : undefined;
    return { ...layerOf(document.json, part, material, texture), ...(image && { image }) };
  });
  return { coordinates, corners: Uint32Array.from(faces), layers };
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

/** Writes the places in the image of the part's vertices. False if they have none. */
function takeCoordinates(document: GltfDocument, part: DrawPart, texture: Part, into: Float32Array): boolean {
  if (texture["index"] === undefined) return false;
  const { json } = document;
  const key = `TEXCOORD_${Number(texture["texCoord"] ?? 0)}`;
  const accessor = partOf(primitiveOf(json, part)["attributes"])[key];
  if (accessor === undefined) return false;
  const numbers = readNumbers(document, indexOf(json, accessor, "accessors", nameOf(json, "meshes", part.block.mesh)), 2);
  const { first, count } = part.block;
  into.set(numbers.subarray(0, 2 * count), 2 * first);
  return true;
}

/** Undefined if it is not in the file. */
function imageOf(document: GltfDocument, texture: Part): Blob | undefined {
  const { json, buffer } = document;
  const { source, extensions } = partOf(listOf(json, "textures")[texture["index"] as number]);
  const webp = partOf(partOf(extensions)["EXT_texture_webp"])["source"];
  const image = partOf(listOf(json, "images")[(webp ?? source) as number]);
  const view = partOf(listOf(json, "bufferViews")[image["bufferView"] as number]);
  const { byteOffset = 0, byteLength = 0 } = view as { byteOffset?: number; byteLength?: number };
  const bytes =
    image["bufferView"] === undefined ? bytesAt(image["uri"], new Map()) : buffer.subarray(byteOffset, byteOffset + byteLength);
  return bytes && new Blob([bytes as Uint8Array<ArrayBuffer>]);
}
