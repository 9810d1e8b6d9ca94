import type { Adjacency } from "lpdeform-client/mesh/adjacency";
import { type Document, withoutField } from "./document.js";

export type PaintField = "p" | "stiffness";

/** What a stroke of painting does: brings the value on, takes what is painted away, or evens it out. */
export type PaintMode = "set" | "erase" | "smooth";

export interface Brush {
  field: PaintField;
  mode: PaintMode;
  /** Of p or stiffness, to bring on. */
  value: number;
}

/**
 * How strongly a brush works at this share of its radius: wholly up to a share of 1 - softness, and from there less and less, not at
 * all at the edge. Without softness it works wholly everywhere.
 */
export function strengthAt(share: number, softness: number): number {
  if (softness <= 0 || share <= 1 - softness) return 1;
  const t = Math.min(Math.max((1 - share) / softness, 0), 1);
  return t * t * (3 - 2 * t);
}

/**
 * The document with a stroke. `strengths`: 0 to 1 for each vertex of the stroke. Values are blended by their logarithms, as their
 * sliders go. Unpainted parts count as p of the slider, and as stiffness 1. `groups`: for each vertex the one whose neighbours it
 * has, if copies of vertices count as one.
 */
export function paintSoftly(
  document: Document,
  strengths: ReadonlyMap<number, number>,
  brush: Brush,
  vertexCount: number,
  adjacency: Adjacency,
  groups?: Uint32Array,
): Document {
  const [key, base, unpainted] =
    brush.field === "p" ? (["paintedP", document.p, NaN] as const) : (["stiffness", 1, 1] as const);
  const before = document[key];
  if (!before && brush.mode !== "set") return document;
  const old = before ?? new Float32Array(vertexCount).fill(unpainted);
  const canvas = { old, base, unpainted, adjacency, groups };
  const now = old.slice();
  for (const [vertex, strength] of strengths) if (strength > 0) now[vertex] = painted(canvas, brush, vertex, strength);
  if (brush.mode === "erase" && now.every((value) => Object.is(value, unpainted))) return withoutField(document, key);
  return { ...document, [key]: now, isAutomatic: false };
}

interface Canvas {
  old: Float32Array;
  /** What unpainted parts count as, and how they are written. */
  base: number;
  unpainted: number;
  adjacency: Adjacency;
  groups: Uint32Array | undefined;
}

function painted(canvas: Canvas, { mode, value }: Brush, vertex: number, strength: number): number {
  const { old, base, unpainted } = canvas;
  const known = (other: number) => (Number.isNaN(old[other]!) ? base : old[other]!);
  switch (mode) {
    case "set":
      return strength === 1 ? value : blend(known(vertex), value, strength);
    case "erase":
      return strength === 1 || Number.isNaN(old[vertex]!) ? unpainted : blend(old[vertex]!, base, strength);
    case "smooth": {
      const around = neighboursOf(canvas, vertex);
      const isPainted = [vertex, ...around].some((other) => !Number.isNaN(old[other]!));
      if (around.length === 0 || !isPainted) return old[vertex]!;
      const mean = around.reduce((sum, other) => sum + Math.log(known(other)), 0) / around.length;
      return blend(known(vertex), Math.exp(mean), strength);
    }
  }
}

function neighboursOf({ adjacency: { starts, neighbours }, groups }: Canvas, vertex: number): Uint32Array {
  const one = groups?.[vertex] ?? vertex;
  return neighbours.subarray(starts[one], starts[one + 1]);
}

function blend(from: number, to: number, share: number): number {
  return Math.exp((1 - share) * Math.log(from) + share * Math.log(to));
}
