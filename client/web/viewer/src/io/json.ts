import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { FileFault } from "lpdeform-client/mesh/fault";

// Values of a JSON file, or a FileFault that names `what`.

export function objectOf(json: unknown, what: string): Record<string, unknown> {
  if (typeof json === "object" && json !== null && !Array.isArray(json)) return json as Record<string, unknown>;
  throw new FileFault(`In the handle file, ${what} is not an object.`);
}

export function arrayOf(json: unknown, what: string): readonly unknown[] {
  if (Array.isArray(json)) return json;
  throw new FileFault(`In the handle file, ${what} is not a list.`);
}

export function textOf(json: unknown, what: string): string {
  if (typeof json === "string" && json !== "" && new TextEncoder().encode(json).length <= 128) return json;
  throw new FileFault(`In the handle file, ${what} is not a text of 1 to 128 bytes.`);
}

export function vector3(json: unknown, what: string): Vector3 {
  if (Array.isArray(json) && json.length === 3 && json.every((value) => Number.isFinite(value)))
    return json as unknown as Vector3;
  throw new FileFault(`In the handle file, ${what} is not [x, y, z].`);
}

export function weightOf(json: unknown, what: string, most: number): number {
  if (typeof json === "number" && json >= 0 && json <= most && Number.isFinite(json)) return json;
  throw new FileFault(
    `In the handle file, ${what} is ${String(json)}, not a number from 0${most < Infinity ? ` to ${most}` : ""}.`,
  );
}

export function checkKeys(object: Record<string, unknown>, known: readonly string[], what: string): void {
  for (const key of Object.keys(object)) {
    if (known.includes(key)) continue;
    throw new FileFault(`In the handle file, ${what} has “${key}”, which is not a key of it; known are ${known.join(", ")}.`);
  }
}

/** Vertex numbers, each once. */
export function vertexNumbers(json: unknown, what: string, vertexCount: number): number[] {
  const numbers = arrayOf(json, what);
  if (numbers.length === 0) throw new FileFault(`In the handle file, ${what} has no vertex.`);
  const seen = new Set<number>();
  for (const number of numbers) {
    if (!Number.isInteger(number) || (number as number) < 0 || (number as number) >= vertexCount) {
      throw new FileFault(
        `In the handle file, ${what} has vertex ${String(number)}; the mesh has vertices 0 to ${vertexCount - 1}.`,
      );
    }
    if (seen.has(number as number)) throw new FileFault(`In the handle file, ${what} has vertex ${String(number)} twice.`);
    seen.add(number as number);
  }
  return [...seen];
}
