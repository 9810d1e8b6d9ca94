import { FileFault } from "./fault.js";
import { jsonFaultAt } from "./json_fault.js";

/** A part of a glTF's JSON. */
export type Part = Record<string, unknown>;

/** A glTF as it came: its JSON, with all that is unknown here, and the bytes of its one buffer. */
export interface GltfDocument {
  json: Part;
  buffer: Uint8Array;
  /** What a GLB has after these: chunks that are unknown here, as they came. */
  chunks?: Uint8Array;
}

const [magic, jsonChunk, binaryChunk] = [0x46546c67, 0x4e4f534a, 0x004e4942];

export function refuse(part: string, what: string): never {
  throw new FileFault(`${part[0]!.toUpperCase()}${part.slice(1)} ${what}.`);
}

/**
 * Reads a GLB, or the JSON of a glTF. Buffers and images in other files are put in if they are `beside` it, by name; several
 * buffers become one. Throws a FileFault.
 */
export function readGltfDocument(
  name: string,
  bytes: Uint8Array,
  beside: ReadonlyMap<string, Uint8Array>,
): GltfDocument {
  const isGlb = bytes.length >= 4 && viewOf(bytes).getUint32(0, true) === magic;
  const { text, binary, chunks } = isGlb ? chunksOf(name, bytes) : { text: bytes };
  let json: Part;
  try {
    json = JSON.parse(new TextDecoder().decode(text)) as Part;
  } catch {
    throw new FileFault(`${name} is no glTF: its JSON breaks off or is wrong at byte ${jsonFaultAt(text) + 1}.`);
  }
  const { version } = partOf(json?.["asset"]);
  if (typeof version !== "string" || !version.startsWith("2.")) throw new FileFault(`${name} is no glTF of version 2.`);
  const buffers = listOf(json, "buffers").map((buffer, k) => {
    const named = nameOf(json, "buffers", k);
    const found = buffer["uri"] === undefined && k === 0 ? binary : bytesAt(buffer["uri"], beside);
    const length = wholeOf(buffer, "byteLength", 0, named);
    if (!found && isData(buffer["uri"])) refuse(named, `of ${name} is a data URI that is not in base64`);
    if (!found) refuse(named, `of ${name} is not in the file; open it together with the glTF, or save it as GLB`);
    if (found.length < length) refuse(named, `of ${name} has ${found.length} bytes in place of ${length}`);
    return found.subarray(0, length);
  });
  const document = { ...joined(json, buffers), ...(chunks && { chunks }) };
  putImagesIn(document, beside);
  return document;
}

interface Chunks {
  text: Uint8Array;
  binary?: Uint8Array;
  chunks?: Uint8Array;
}

function chunksOf(name: string, bytes: Uint8Array): Chunks {
  const view = viewOf(bytes);
  if (bytes.length < 20 || view.getUint32(4, true) !== 2) throw new FileFault(`${name} is no GLB of version 2.`);
  const length = view.getUint32(12, true);
  if (view.getUint32(8, true) > bytes.length) {
    throw new FileFault(`${name} ends too soon: it has ${bytes.length} of ${view.getUint32(8, true)} bytes.`);
  }
  if (20 + length > bytes.length) throw new FileFault(`${name} ends within its chunk JSON.`);
  if (view.getUint32(16, true) !== jsonChunk) throw new FileFault(`${name} does not begin with JSON.`);
  const text = bytes.subarray(20, 20 + length);
  const at = 28 + length;
  if (at > bytes.length || view.getUint32(at - 4, true) !== binaryChunk) return { text, ...othersFrom(at - 8, bytes) };
  const size = view.getUint32(at - 8, true);
  if (at + size > bytes.length) throw new FileFault(`${name} ends within its chunk BIN.`);
  return { text, binary: bytes.subarray(at, at + size), ...othersFrom(at + size, bytes) };
}

/** Chunks that are whole, up to the length that the file says. */
function othersFrom(begin: number, bytes: Uint8Array): Pick<Chunks, "chunks"> {
  const view = viewOf(bytes);
  let end = begin;
  for (let next = begin; next <= view.getUint32(8, true);) {
    end = next;
    if (next + 8 > bytes.length) break;
    next += 8 + view.getUint32(next, true);
  }
  return end > begin ? { chunks: bytes.subarray(begin, end) } : {};
}

export function writeGlb({ json, buffer, chunks = new Uint8Array(0) }: GltfDocument): Uint8Array<ArrayBuffer> {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const [textSize, bufferSize] = [aligned(text.length), aligned(buffer.length)];
  const bytes = new Uint8Array(28 + textSize + bufferSize + chunks.length).fill(0x20, 20, 20 + textSize);
  const view = viewOf(bytes);
  [magic, 2, bytes.length, textSize, jsonChunk].forEach((number, k) => view.setUint32(4 * k, number, true));
  bytes.set(text, 20);
  view.setUint32(20 + textSize, bufferSize, true);
  view.setUint32(24 + textSize, binaryChunk, true);
  bytes.set(buffer, 28 + textSize);
  bytes.set(chunks, 28 + textSize + bufferSize);
  return bytes;
}

function joined(json: Part, buffers: readonly Uint8Array[]): GltfDocument {
  let [first] = buffers;
  if (buffers.length > 1) {
    const begins: number[] = [];
    let size = 0;
    for (const { length } of buffers) {
      begins.push(size);
      size += aligned(length);
    }
    first = new Uint8Array(size);
    buffers.forEach((buffer, k) => first!.set(buffer, begins[k]));
    listOf(json, "bufferViews").forEach((view, k) => {
      const named = nameOf(json, "bufferViews", k);
      const begin = begins[indexOf(json, view["buffer"], "buffers", named)]!;
      if (begin > 0) view["byteOffset"] = begin + wholeOf(view, "byteOffset", 0, named);
      view["buffer"] = 0;
    });
  }
  const buffer = first ?? new Uint8Array(0);
  const { uri: _, ...kept } = listOf(json, "buffers")[0] ?? {};
  if (first) json["buffers"] = [{ ...kept, byteLength: buffer.length }];
  return { json, buffer };
}

function putImagesIn(document: GltfDocument, beside: ReadonlyMap<string, Uint8Array>): void {
  for (const image of listOf(document.json, "images")) {
    const { uri } = image;
    const ending = typeof uri === "string" ? (/\.(png|jpe?g|webp|ktx2)$/i.exec(uri)?.[1]?.toLowerCase() ?? "") : "";
    const found = ending === "" || isData(uri) ? undefined : bytesAt(uri, beside);
    if (!found) continue;
    image["bufferView"] = appendView(document, found);
    image["mimeType"] ??= `image/${ending === "jpg" ? "jpeg" : ending}`;
    delete image["uri"];
  }
}

/** Appends bytes to the buffer, and returns the number of their new bufferView. */
export function appendView(document: GltfDocument, bytes: Uint8Array, target?: number): number {
  const begin = aligned(document.buffer.length);
  const buffer = new Uint8Array(begin + bytes.length);
  buffer.set(document.buffer);
  buffer.set(bytes, begin);
  document.buffer = buffer;
  listOf(document.json, "buffers")[0]!["byteLength"] = buffer.length;
  const views = document.json["bufferViews"] as Part[];
  const view = { buffer: 0, byteOffset: begin, byteLength: bytes.length, ...(target !== undefined && { target }) };
  return views.push(view) - 1;
}

const isData = (uri: unknown) => typeof uri === "string" && uri.startsWith("data:");

/** The bytes of a data URI, or of a file that was opened together with the glTF. */
export function bytesAt(uri: unknown, beside: ReadonlyMap<string, Uint8Array>): Uint8Array | undefined {
  if (typeof uri !== "string") return undefined;
  if (!isData(uri)) return beside.get(decoded(uri).split("/").at(-1)!);
  const text = /^data:[^,]*;base64,/.exec(uri);
  try {
    return text ? Uint8Array.from(atob(uri.slice(text[0].length)), (letter) => letter.charCodeAt(0)) : undefined;
  } catch {
    return undefined;
  }
}

function decoded(uri: string): string {
  try {
    return decodeURIComponent(uri);
  } catch {
    return uri;
  }
}

const aligned = (size: number) => 4 * Math.ceil(size / 4);

export function viewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** The object; one without keys if it is none. */
export function partOf(value: unknown): Part {
  return typeof value === "object" && value !== null && !Array.isArray(value) ? (value as Part) : {};
}

/** Lists whose items were found to be objects: files may have thousands of them, and they are asked for again and again. */
const sound = new WeakSet<object>();

/** A list of the JSON, empty if there is none. Its items are objects. */
export function listOf(json: Part, list: string): Part[] {
  const items = json[list] ?? [];
  const isSound =
    Array.isArray(items) && (sound.has(items) || items.every((item) => typeof item === "object" && item !== null));
  if (!isSound) refuse(`“${list}”`, "is no list of objects");
  sound.add(items);
  return items as Part[];
}

const longestName = 60;

/** A name that a file gives, in quotes. It is cut where it is long. */
export function quoted(name: string): string {
  const isLong = name.length > longestName;
  return `“${isLong ? `${name.slice(0, longestName).replace(/[\ud800-\udbff]$/, "")}...` : name}”`;
}

/** “mesh 3 (“body”)”. */
export function nameOf(json: Part, list: string, index: number): string {
  const name = partOf((json[list] as unknown[] | undefined)?.[index])["name"];
  const kind = list === "meshes" ? "mesh" : list.slice(0, -1);
  return typeof name === "string" && name !== "" ? `${kind} ${index} (${quoted(name)})` : `${kind} ${index}`;
}

export function indexOf(json: Part, value: unknown, list: string, part: string): number {
  const { length } = listOf(json, list);
  if (!Number.isInteger(value) || (value as number) < 0 || (value as number) >= length)
    refuse(part, `names none of the ${length} ${list}`);
  return value as number;
}

export function wholeOf(object: Part, key: string, otherwise: number, part: string): number {
  const value = object[key] ?? otherwise;
  if (!Number.isSafeInteger(value) || (value as number) < 0) refuse(part, `has a “${key}” that is no whole number`);
  return value as number;
}
