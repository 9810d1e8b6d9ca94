import { LpdeformError } from "./errors.js";

// What keys.ts checks values with. All throw an LpdeformError that names `element`.

/** Vectors among the values of `given`. */
export function checkVectors<Bag extends object>(
  given: Bag,
  keys: readonly (keyof Bag & string)[],
  owner: string,
): void {
  for (const key of keys) checkVector(given[key], `${key} of ${owner}`);
}

export function checkVector(value: unknown, element: string): void {
  if (value === undefined) return;
  const isVector =
    typeof value === "object" &&
    value !== null &&
    isNumbers(value) &&
    (value as ArrayLike<unknown>).length === 3 &&
    Array.from(value as ArrayLike<unknown>).every((number) => typeof number === "number");
  if (!isVector) throw mistyped(`${element} is ${JSON.stringify(value)}`, element, "three numbers");
}

export function isNumbers(value: object): boolean {
  return Array.isArray(value) || ArrayBuffer.isView(value);
}

export function checkKeys(given: object, known: Readonly<Record<string, unknown>>, element: string): void {
  for (const key of Object.keys(given)) {
    if (!Object.hasOwn(known, key)) throw refused(`${element} has the unknown key "${key}"`, element, known);
  }
}

export function checkWord(given: string | undefined, known: Readonly<Record<string, unknown>>, element: string): void {
  if (given === undefined || Object.hasOwn(known, given)) return;
  throw refused(`${element} is "${given}", which is not known`, element, known);
}

export function mistyped(what: string, element: string, limit: string): LpdeformError {
  const text = `${what[0]!.toUpperCase()}${what.slice(1)}; it must be ${limit}.`;
  return new LpdeformError("invalid_argument", text, { reason: "ARRAY_TYPE", element, limit });
}

export function refused(what: string, element: string, known: object): LpdeformError {
  const limit = Object.keys(known).join(", ");
  const text = `${what[0]!.toUpperCase()}${what.slice(1)}; known are ${limit}.`;
  return new LpdeformError("invalid_argument", text, { reason: "UNKNOWN_KEY", element, limit });
}
