import { type Adjacency, adjacencyOf, meanEdge } from "./adjacency.js";
import { type Drawn, drawnOf } from "./drawn.js";
import { faceOrder } from "./face_blocks.js";
import { type Bounds, boundsOf, type Mesh } from "./mesh.js";
import { type Seams, seamsOf } from "./seams.js";
import { guessYUp } from "./up.js";

/** What is found of the faces of a mesh, welded or not. */
export interface Shown {
  adjacency: Adjacency;
  drawn: Drawn;
}

/** What is found of a mesh before it is shown. It takes about a second for 100,000 vertices. */
export interface Derived {
  seams: Seams | undefined;
  bounds: Bounds;
  /** The mean length of the edges. */
  edge: number;
  isYUp: boolean;
  /** See faceOrder(). */
  order: Uint32Array;
  /** Of the welded faces, if there are seams. */
  shown: Shown;
}

const known = new WeakMap<Mesh, Derived>();
const shownOfFaces = new WeakMap<Uint32Array, Shown>();

/** Found once for each mesh. */
export function derivedOf(mesh: Mesh): Derived {
  const before = known.get(mesh);
  if (before) return before;
  const derived = derive(mesh);
  know(mesh, derived);
  return derived;
}

/** It was found elsewhere. */
export function know(mesh: Mesh, derived: Derived): void {
  known.set(mesh, derived);
  shownOfFaces.set(derived.seams?.faces ?? mesh.faces, derived.shown);
}

/** Found once for each array of faces; `faces`: the mesh's own, or those of its seams. */
export function shownOf(mesh: Mesh, faces: Uint32Array): Shown {
  const before = shownOfFaces.get(faces);
  if (before) return before;
  const shown = show(mesh, faces);
  shownOfFaces.set(faces, shown);
  return shown;
}

function show({ positions }: Mesh, faces: Uint32Array): Shown {
  return { adjacency: adjacencyOf(positions.length / 3, faces), drawn: drawnOf({ positions, faces }) };
}

export function derive(mesh: Mesh): Derived {
  const { positions, faces } = mesh;
  const seams = seamsOf(mesh);
  const shown = show(mesh, seams?.faces ?? faces);
  const own = seams ? adjacencyOf(positions.length / 3, faces) : shown.adjacency;
  return {
    seams,
    bounds: boundsOf(positions, faces),
    edge: meanEdge(own, positions),
    isYUp: guessYUp(mesh),
    order: faceOrder(positions, faces),
    shown,
  };
}
