import { addHandle, type Document, emptyDocument, type Handle } from "./document.js";
import { creature } from "./creature.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { blockSurface } from "./block.js";

export type Detail = "coarse" | "medium" | "fine";

/** A generated mesh with handles to begin with: the first ones stay, the last one is there to be dragged. */
export interface Shape {
  mesh: Mesh;
  document: Document;
  /** The handle to begin with. */
  first: string;
}

export interface ShapeKind {
  id: string;
  title: string;
  make: (detail: Detail) => Shape;
}

export const shapeKinds: readonly ShapeKind[] = [
  { id: "bar", title: "Bar", make: bar },
  { id: "sheet", title: "Sheet", make: sheet },
  { id: "block", title: "Block with holes", make: block },
  { id: "creature", title: "Creature", make: beast },
];

/** The bar of the paper's Figure 4 (coarse: 370 vertices), upright. */
function bar(detail: Detail): Shape {
  const cells = { coarse: 4, medium: 10, fine: 21 }[detail];
  const height = Math.round((21 / 4) * cells);
  const mesh = scaled(
    "bar",
    blockSurface(cells, cells, height, () => true),
    1 / cells,
  );
  const [low, high] = extent(mesh, 2);
  return withHandles(mesh, [
    ["Base", (v) => v[2]! < low + 0.01],
    ["Top", (v) => v[2]! > high - 0.01],
  ]);
}

/** The sheet of the paper's Figure 3 (medium: 3962 vertices), upright. */
function sheet(detail: Detail): Shape {
  const scale = { coarse: 0.5, medium: 1, fine: 1.6 }[detail];
  const [width, height] = [Math.round(30 * scale), Math.round(60 * scale)];
  const mesh = scaled(
    "sheet",
    blockSurface(2, width, height, () => true),
    3 / width,
  );
  for (let k = 0; k < mesh.positions.length; k += 3) mesh.positions[k]! *= 2 / scale / 3;
  const [low, high] = extent(mesh, 2);
  return withHandles(mesh, [
    ["Base", (v) => v[2]! < low + 0.15],
    ["Top", (v) => v[2]! > high - 0.15],
  ]);
}

/** A row of three square holes, as wide as the bars between them. */
function block(detail: Detail): Shape {
  const unit = { coarse: 2, medium: 4, fine: 7 }[detail];
  const isHole = (x: number, z: number) => Math.floor(x / unit - 1) % 4 < 2 && x >= unit && z >= unit && z < 3 * unit;
  const mesh = scaled(
    "block",
    blockSurface(12 * unit, 2 * unit, 4 * unit, (x, _, z) => !isHole(x, z)),
    1 / (2 * unit),
  );
  const [low, high] = extent(mesh, 0);
  return withHandles(mesh, [
    ["Left", (v) => v[0]! < low + 0.01],
    ["Right", (v) => v[0]! > high - 0.01],
  ]);
}

function beast(detail: Detail): Shape {
  const mesh = creature({ coarse: 60, medium: 86, fine: 113 }[detail]);
  return withHandles(mesh, [
    ["Feet", (v) => v[2]! < 0.07],
    ["Tail", (v) => v[0]! < -0.8],
    ["Head", (v) => v[0]! > 0.52 && v[2]! > 0.6],
  ]);
}

function scaled(name: string, mesh: Mesh, scale: number): Mesh {
  const positions = mesh.positions.map((value) => value * scale);
  return { ...mesh, name, positions };
}

function extent({ positions }: Mesh, axis: number): [number, number] {
  let low = Infinity;
  let high = -Infinity;
  for (let k = axis; k < positions.length; k += 3) {
    low = Math.min(low, positions[k]!);
    high = Math.max(high, positions[k]!);
  }
  return [low, high];
}

type Place = (position: Float32Array) => boolean;

function withHandles(mesh: Mesh, places: readonly (readonly [string, Place])[]): Shape {
  let document: Document = emptyDocument;
  places.forEach(([name, isThere], order) => {
    const vertices: number[] = [];
    for (let v = 0; 3 * v < mesh.positions.length; ++v) {
      if (isThere(mesh.positions.subarray(3 * v, 3 * v + 3))) vertices.push(v);
    }
    const options: Partial<Handle> = { name, isLocked: order === 0 };
    document = addHandle(document, vertices, mesh.positions, options);
  });
  return { mesh, document, first: places.at(-1)![0] };
}
