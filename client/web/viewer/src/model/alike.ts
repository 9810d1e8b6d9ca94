/** Whether plain values, including nested arrays and objects, are equal. */
export function isAlike(a: unknown, b: unknown): boolean {
  if (Object.is(a, b)) return true;
  if (typeof a !== "object" || typeof b !== "object" || a === null || b === null) return false;
  if (ArrayBuffer.isView(a) || ArrayBuffer.isView(b)) return areSameNumbers(a as Float32Array, b as Float32Array);
  const [mine, theirs] = [Object.keys(a), Object.keys(b)];
  const isSame = (key: string) => key in b && isAlike(a[key as keyof typeof a], b[key as keyof typeof b]);
  return mine.length === theirs.length && mine.every(isSame);
}

function areSameNumbers(a: Float32Array, b: Float32Array): boolean {
  return a.length === b.length && a.every((value, k) => Object.is(value, b[k]));
}
