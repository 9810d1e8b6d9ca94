import { FileFault } from "lpdeform-client/mesh/fault";

const kinds = { u8: Uint8Array, u32: Uint32Array, f32: Float32Array, f64: Float64Array } as const;
type Kind = keyof typeof kinds;

export type Numbers = Uint8Array | Uint32Array | Float32Array | Float64Array;

/** Arrays by their names. */
export type Sections = Readonly<Record<string, Numbers>>;

/**
 * One line of JSON, and after it the arrays, which the line lists as its "sections". Numbers are little-endian. Throws a FileFault if
 * that is more than `mostBytes`.
 */
export function joinSections(head: object, arrays: Sections, mostBytes: number): Uint8Array<ArrayBuffer> {
  const sections = Object.entries(arrays).map(([name, array]) => ({ name, kind: kindOf(array), length: array.length }));
  const line = new TextEncoder().encode(`${JSON.stringify({ ...head, sections })}\n`);
  const size = Object.values(arrays).reduce((sum, { byteLength }) => sum + byteLength, line.length);
  if (size > mostBytes) throw new FileFault(`The project would hold more than ${mostBytes / 1e6} MB.`);
  const all = new Uint8Array(size);
  all.set(line);
  let at = line.length;
  for (const { buffer, byteOffset, byteLength } of Object.values(arrays)) {
    all.set(new Uint8Array(buffer, byteOffset, byteLength), at);
    at += byteLength;
  }
  return all;
}

/** The reverse. Throws a FileFault that names `file`; the head's values are not checked. */
export function splitSections(bytes: Uint8Array<ArrayBuffer>, file: string): [Record<string, unknown>, Sections] {
  const end = bytes.indexOf(10);
  const head = end < 0 ? undefined : jsonOf(bytes.subarray(0, end));
  if (!isObject(head)) throw new FileFault(`${file} is not a project of this page: it does not begin as one.`);
  const arrays: Record<string, Numbers> = {};
  let at = end + 1;
  for (const section of Array.isArray(head["sections"]) ? (head["sections"] as unknown[]) : []) {
    const { name, kind, length } = isObject(section) ? section : {};
    if (typeof name !== "string" || !isKind(kind) || !Number.isSafeInteger(length) || (length as number) < 0) {
      throw new FileFault(`${file} lists a section that has no name, no known kind, or no length.`);
    }
    const size = (length as number) * kinds[kind].BYTES_PER_ELEMENT;
    if (at + size > bytes.length) throw new FileFault(`${file} ends within its section “${name}”.`);
    arrays[name] = new kinds[kind](bytes.slice(at, at + size).buffer);
    at += size;
  }
  if (at < bytes.length) throw new FileFault(`${file} has ${bytes.length - at} bytes after its last section.`);
  return [head, arrays];
}

function kindOf(array: Numbers): Kind {
  return (Object.keys(kinds) as Kind[]).find((kind) => array instanceof kinds[kind])!;
}

function isKind(value: unknown): value is Kind {
  return typeof value === "string" && Object.hasOwn(kinds, value);
}

export function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function jsonOf(bytes: Uint8Array): unknown {
  try {
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    return undefined;
  }
}
