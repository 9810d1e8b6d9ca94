import type { Mesh } from "./mesh.js";

const kinds = { Float64Array, Float32Array, Uint32Array, Uint8Array } as const;

/**
 * A mesh for the browser's database: its arrays are bytes of a Blob, so that nobody has to copy them to store or to pass it on, and
 * the rest is as it is.
 */
export interface StoredMesh {
  /** The arrays in the order of their bytes. */
  arrays: { key: keyof Mesh; kind: keyof typeof kinds; length: number }[];
  blob: Blob;
  rest: Omit<Partial<Mesh>, "positions" | "faces">;
}

export function stored(mesh: Mesh): StoredMesh {
  const all = Object.entries(mesh) as [keyof Mesh, unknown][];
  const found = all.filter((entry): entry is [keyof Mesh, ArrayBufferView & ArrayLike<number>] =>
    ArrayBuffer.isView(entry[1]),
  );
  found.sort(([, a], [, b]) => kindOf(b).size - kindOf(a).size); // the widest first, so that each is aligned
  return {
    arrays: found.map(([key, array]) => ({ key, kind: kindOf(array).kind, length: array.length })),
    blob: new Blob(found.map(([, array]) => array as unknown as BlobPart)),
    rest: Object.fromEntries(all.filter(([, value]) => !ArrayBuffer.isView(value))),
  };
}

/** Rejects if the browser no longer has the bytes. */
export async function restored({ arrays, blob, rest }: StoredMesh): Promise<Mesh> {
  const bytes = await blob.arrayBuffer();
  const mesh: Record<string, unknown> = { ...rest };
  let at = 0;
  for (const { key, kind, length } of arrays) {
    const array = new kinds[kind](bytes, at, length);
    mesh[key] = array;
    at += array.byteLength;
  }
  return mesh as unknown as Mesh;
}

function kindOf(array: unknown): { kind: keyof typeof kinds; size: number } {
  const [kind, { BYTES_PER_ELEMENT: size }] = Object.entries(kinds).find(([, one]) => array instanceof one)!;
  return { kind: kind as keyof typeof kinds, size };
}
