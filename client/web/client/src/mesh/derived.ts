import { LpdeformError } from "../errors.js";
import { checkKeys, mistyped } from "../key_checks.js";
import type { DrawnAt, Weld } from "../types.js";
import { type Adjacency, adjacencyOf, meanEdge, shortestEdge } from "./adjacency.js";
import { drawnAt } from "./drawmesh.js";
import { type Drawn, drawnOf } from "./drawn.js";
import { faceOrder } from "./face_blocks.js";
import { type Bounds, boundsOf, type Mesh } from "./mesh.js";
import { looseVertices, type Seams, seamsOf, usualTolerance } from "./seams.js";
import { guessYUp } from "./up.js";

/** Which vertices count as one. */
export interface Welding {
  /**
   * How far apart vertices in one place may be, as a share of the diagonal: 0 to 0.001, as servers take it. Up to 1e-6 this is
   * about vertices on open borders, above that about all vertices.
   */
  tolerance: number;
  /** Whether they count as one; if not, seams are found and nothing else. */
  isOn: boolean;
}

/** The server's own tolerance. */
export const usualWelding: Welding = { tolerance: usualTolerance, isOn: true };

const mostTolerance = 1e-3;

/** Throws an LpdeformError: WELD_TOLERANCE, UNKNOWN_KEY, or ARRAY_TYPE for an `isOn` that is no boolean. */
export function checkWelding(welding: Welding): void {
  checkKeys(welding, { tolerance: true, isOn: true } satisfies Record<keyof Welding, true>, "welding");
  const { tolerance, isOn } = welding;
  if (typeof isOn !== "boolean")
    throw mistyped(`isOn of welding is ${String(isOn)}`, "isOn of welding", "true or false");
  if (typeof tolerance === "number" && tolerance >= 0 && tolerance <= mostTolerance) return;
  throw new LpdeformError(
    "invalid_argument",
    `The weld's tolerance is ${String(tolerance)} of the diagonal; it must be 0 to ${mostTolerance}.`,
    { reason: "WELD_TOLERANCE", element: "weld tolerance", limit: `0 <= tolerance <= ${mostTolerance}` },
  );
}

/** What is found of the faces of a mesh, welded or not. */
export interface Shown {
  adjacency: Adjacency;
  drawn: Drawn;
  /** Of the drawn vertices at rest. They do not change. */
  atRest: DrawnAt;
}

/** What is found of a mesh before it is shown. It takes about a second for 100,000 vertices. */
export interface Derived {
  welding: Welding;
  seams: Seams | undefined;
  /** Vertices on open borders that are not one with others near them: see looseVertices(). */
  looseCount: number;
  bounds: Bounds;
  /** The mean length of the edges, and the least. */
  edge: number;
  shortestEdge: number;
  isYUp: boolean;
  /** See faceOrder(). */
  order: Uint32Array;
  /** Of the welded faces, if there are seams and they are welded. */
  shown: Shown;
}

const known = new WeakMap<Mesh, Derived>();

/**
 * For `weld` of openSession(); undefined if no two vertices are one. Servers take groups of what lies within the usual tolerance only;
 * what lies farther apart they find themselves, as seamsOf() does.
 */
export function weldOf({ seams, welding: { tolerance, isOn } }: Derived): Weld | undefined {
  if (!isOn || !seams) return undefined;
  return tolerance > usualTolerance ? { tolerance } : seams.groups;
}

/** What was found last, or is found now with the usual welding. */
export function derivedOf(mesh: Mesh): Derived {
  const before = known.get(mesh);
  if (before) return before;
  const derived = derive(mesh, usualWelding);
  know(mesh, derived);
  return derived;
}

/** It was found elsewhere. */
export function know(mesh: Mesh, derived: Derived): void {
  known.set(mesh, derived);
}

export function isKnown(mesh: Mesh, { tolerance, isOn }: Welding): boolean {
  const before = known.get(mesh)?.welding;
  return before?.tolerance === tolerance && before.isOn === isOn;
}

export function derive(mesh: Mesh, welding: Welding): Derived {
  const { positions, faces } = mesh;
  const seams = seamsOf(mesh, welding.tolerance);
  const own = adjacencyOf(positions.length / 3, faces);
  const welded = welding.isOn && seams?.faces;
  const drawn = drawnOf({ positions, faces: welded || faces });
  const edge = meanEdge(own, positions);
  const adjacency = welded ? adjacencyOf(positions.length / 3, welded) : own;
  const shown = {
    adjacency,
    drawn,
    atRest: drawnAt(positions, drawn),
  };
  return {
    welding,
    seams,
    looseCount: looseVertices(mesh, welded || faces, adjacency, edge),
    bounds: boundsOf(positions, faces),
    edge,
    shortestEdge: shortestEdge(own, positions),
    isYUp: guessYUp(mesh),
    order: faceOrder(positions, faces),
    shown,
  };
}
