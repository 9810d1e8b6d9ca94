import type { Handle } from "../model/document.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { add, subtract } from "../model/pose.js";
import { vertexNormals } from "lpdeform-client/mesh/normals";
import { facing, project } from "../model/selection.js";
import { gridStep, nearestTo, onGrid } from "../model/snap.js";
import { type PointerAt, viewProjection } from "../stage/pointing.js";
import type { Pane } from "./pane.js";
import type { Workbench } from "./workbench.js";

/** Keeps the drag of a handle to what the user has chosen. */
export class DragSnap {
  /** Where a drag may go: each vertex that handles hold which stay, and otherwise the vertices of the mesh at rest. */
  #places: Float32Array | undefined;

  /** What goes to a vertex: the handle's vertex that is nearest to where it was taken. */
  readonly #held: Vector3;

  /** `grip`: the place that was taken. `moving`: all handles that the drag moves. */
  constructor(
    readonly work: Workbench,
    readonly pane: Pane,
    readonly handle: Handle,
    readonly moving: readonly Handle[],
    grip: Vector3,
  ) {
    const { positions } = pane.stage.surface!;
    const places = handle.vertices.map((vertex) => [...positions.subarray(3 * vertex, 3 * vertex + 3)] as unknown as Vector3);
    const far = (place: Vector3) => Math.hypot(...subtract(place, grip));
    this.#held = places.reduce((best, place) => (far(place) < far(best) ? place : best), places[0] ?? grip);
  }

  /** The movement since the start of the drag that takes the place of this one. */
  apply(delta: Vector3, at: PointerAt): Vector3 {
    const { snapping } = this.work.view.now;
    if (snapping === "grid") return this.#onGrid(delta);
    return snapping === "vertices" ? this.#toVertex(delta, at) : delta;
  }

  /** The handle's movement from rest is one of whole steps. */
  #onGrid(delta: Vector3): Vector3 {
    const { targets, pose } = this.handle;
    const before = targets ? ([0, 0, 0] as const) : pose.translation;
    return subtract(onGrid(before, add(before, delta), gridStep(this.work.diagonal)), before);
  }

  #toVertex(delta: Vector3, { x, y }: PointerAt): Vector3 {
    const { stage } = this.pane;
    this.#places ??= this.#findPlaces();
    const screen = project(this.#places, viewProjection(stage), stage.width, stage.height);
    const nearest = nearestTo(screen, x, y);
    if (nearest === undefined) return delta;
    const place = [...this.#places.subarray(3 * nearest, 3 * nearest + 3)] as unknown as Vector3;
    return subtract(place, this.#held);
  }

  /** Without those of the handles that move, and those that face away; the view stays during a drag. */
  #findPlaces(): Float32Array {
    const { work, pane, moving } = this;
    const { stage } = pane;
    const places = Float32Array.from(work.mesh.positions);
    for (const { vertices } of work.document.handles) {
      for (const at of vertices.map((vertex) => 3 * vertex)) places.set(stage.surface!.positions.subarray(at, at + 3), at);
    }
    const normals = vertexNormals(places, work.mesh.faces);
    const all = Array.from({ length: places.length / 3 }, (_, vertex) => vertex);
    const wanted = new Set(facing(all, places, normals, stage.eye));
    for (const { vertices } of moving) for (const vertex of vertices) wanted.delete(vertex);
    return places.map((value, k) => (wanted.has(Math.floor(k / 3)) ? value : NaN));
  }
}
