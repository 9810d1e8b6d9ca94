import { addHandle, type Document, extendHandle, type Handle, handleOf, ownersOf, releaseVertices } from "../model/document.js";
import { isAtRest, type Vector3 } from "lpdeform-client/mesh/mesh";
import { partnerOf } from "../model/symmetric.js";
import { nothing, ofVertices } from "../model/pointed.js";
import { follow, placesOf } from "../model/places.js";
import { add, type Pose, subtract } from "../model/pose.js";
import { boxPolygon, dab, facing, insidePolygon, project } from "../model/selection.js";
import { movableOf, posedTogether, selecting, selectionOf, shiftedTogether, toggled } from "../model/together.js";
import { vertexNormals } from "lpdeform-client/mesh/normals";
import { onPlane, type PointerAt, Pointing, type PointingTarget, type Stroke, viewProjection } from "../stage/pointing.js";
import { KeyPointer } from "./key_pointer.js";
import type { Pane } from "./pane.js";
import { DragSnap } from "./drag_snap.js";
import { PaintStroke } from "./paint_stroke.js";
import { Readout } from "./readout.js";
import type { Workbench } from "./workbench.js";

/** A press that has had its effect. */
const stays: Stroke = { move: () => undefined, end: () => undefined, cancel: () => undefined };

/** The tools: what pointing at a pane does to the work. */
export class Editing implements PointingTarget {
  readonly #pointing: Pointing;
  readonly #readout: Readout;

  constructor(
    readonly work: Workbench,
    readonly pane: Pane,
  ) {
    const { gizmo } = pane.stage;
    gizmo.onPose = (pose) => this.#pose(pose);
    gizmo.onEnd = () => work.endGesture();
    gizmo.onCancel = () => work.cancelGesture();
    this.#pointing = new Pointing(pane.stage, this);
    this.#readout = new Readout(work, pane);
    new KeyPointer(pane, {
      hover: (event) => this.#hoverByKey(event),
      press: (event) => this.#workAt(this.#pointing.at(event)),
    });
    const setViewOnly = (event: KeyboardEvent, isDown: boolean) => {
      if (event.code === "Space") this.#pointing.isViewOnly = isDown;
    };
    const { signal } = pane.over;
    window.addEventListener("keydown", (event) => setViewOnly(event, true), { signal });
    window.addEventListener("keyup", (event) => setViewOnly(event, false), { signal });
  }

  /** Reverts what the pointer does in this picture. False if it does nothing. */
  cancel(): boolean {
    return this.pane.stage.gizmo.cancel() || this.#pointing.cancel();
  }

  /** What the pointer has done so far is in the document. */
  flush(): void {
    this.#pointing.flush();
  }

  /** Ends a drag as if the pointer was released: what it has moved becomes a step; what it has drawn is dropped. */
  release(): void {
    if (!this.pane.stage.gizmo.isDragging && !this.#pointing.isBusy) return;
    this.flush();
    this.work.endGesture();
    this.cancel();
  }

  /** The surface may have moved. */
  refresh(): void {
    this.#readout.refresh();
  }

  press(at: PointerAt): Stroke | undefined {
    this.#readout.hide();
    if (this.work.isWatching) return undefined;
    switch (this.work.view.now.tool) {
      case "move":
        return this.#pressHandle(at);
      case "brush":
        return at.hit && this.#brushStroke(at);
      case "paint":
        return at.hit && this.#paintStroke(at);
      case "lasso":
        return this.#outlineStroke(at, (outline) => outline);
      case "box":
        return this.#outlineStroke(at, (outline) => boxPolygon(at.x, at.y, outline.at(-2)!, outline.at(-1)!));
    }
  }

  /** With the move tool, a click on the surface makes a handle; a click beside it clears the selection. */
  click(at: PointerAt): void {
    const { work } = this;
    if (work.view.now.tool !== "move" || work.isWatching) return;
    if (!at.hit) return work.view.set({ selected: undefined });
    this.#select(this.#dabAt(at), at.shift ? "add" : work.view.now.mode);
  }

  hover(at: PointerAt | undefined): void {
    this.#readout.point(at);
    const { tool } = this.work.view.now;
    if (tool !== "brush" && tool !== "paint") return;
    this.work.facts.set({ pointedOut: at?.hit ? ofVertices(this.#onBothSides(this.#dabAt(at))) : nothing });
  }

  #hoverByKey(event: PointerEvent | undefined): void {
    const at = event && this.#pointing.at(event);
    this.work.facts.set({ pointedOut: at?.hit ? ofVertices(this.#onBothSides(this.#dabAt(at))) : nothing });
    this.#readout.point(at, true);
  }

  /** A press by key: uses the tool at one place. */
  #workAt(at: PointerAt): boolean {
    const { work } = this;
    if (work.isWatching) return false;
    if (!at.hit) {
      work.notify("There is no surface under the cross: arrow keys move it.");
      return false;
    }
    if (work.view.now.tool === "paint") {
      this.#paintStroke(at).end();
      return false;
    }
    const mode = modeOf(at, work);
    const owner = mode === "new" ? this.#handleAt(at) : undefined;
    if (owner) work.view.set({ selected: owner.name });
    else this.#select(this.#dabAt(at), mode);
    const handle = handleOf(work.document, work.view.now.selected);
    if (handle) {
      const canMove = !handle.isLocked && !handle.targets;
      work.notify(`“${handle.name}” holds ${handle.vertices.length} vertices${canMove ? "; arrow keys move it" : ""}.`);
    }
    return handle !== undefined && mode === "new";
  }

  #dabAt({ hit }: PointerAt): number[] {
    const { work, pane } = this;
    const radius = work.view.now.radius * work.diagonal;
    const { seams, adjacency } = work;
    const seed = seams?.groups[hit!.vertex] ?? hit!.vertex;
    return this.#withCopies(dab(pane.stage.surface!.positions, adjacency, seed, hit!.point, radius));
  }

  /** Adds the copies of each vertex, because they belong together. */
  #withCopies(vertices: number[]): number[] {
    return this.work.seams?.withCopies(vertices) ?? vertices;
  }

  #imageOf(vertices: readonly number[]): number[] {
    const { mirror } = this.work;
    return mirror ? this.#withCopies([...mirror.imagesOf(vertices).keys()]) : [];
  }

  #onBothSides(vertices: readonly number[]): readonly number[] {
    return this.work.mirror ? [...new Set([...vertices, ...this.#imageOf(vertices)])] : vertices;
  }

  #pressHandle(at: PointerAt): Stroke | undefined {
    const handle = this.#handleAt(at);
    if (!handle) return undefined;
    const { view } = this.work;
    if (at.control) {
      view.set(toggled(view.now, handle.name));
      return stays;
    }
    view.set(selecting(view.now, handle.name));
    return this.work.canShift(handle) ? this.#drag(handle, at) : undefined;
  }

  /** The handle that holds a vertex of the face under the pointer, or one nearby on the screen, for fingers. */
  #handleAt(at: PointerAt): Handle | undefined {
    const { work, pane } = this;
    const { hit } = at;
    const { handles } = work.document;
    if (hit) {
      const owners = ownersOf(work.document);
      const face = work.mesh.faces.subarray(3 * hit.face, 3 * hit.face + 3);
      const owner =
        handles.find(({ points }) => points?.some((point) => point.face === hit.face)) ??
        owners.get(hit.vertex) ??
        [...face].map((vertex) => owners.get(vertex)).find((one) => one);
      if (owner) return owner;
    }
    const { surface, width, height } = pane.stage;
    if (!surface) return undefined;
    const matrix = viewProjection(pane.stage);
    let least = at.isTouch ? 18 : 7;
    let nearest: Handle | undefined;
    for (const handle of handles) {
      const places = follow(placesOf(handle.vertices, handle.points, work.mesh.faces), surface.positions);
      const screen = project(places, matrix, width, height);
      for (let k = 0; 2 * k < screen.length; ++k) {
        const far = Math.hypot(screen[2 * k]! - at.x, screen[2 * k + 1]! - at.y);
        if (!(far < least)) continue;
        if (hit && distanceTo(at, places, k) > hit.distance + 0.02 * work.diagonal) continue; // hidden
        least = far;
        nearest = handle;
      }
    }
    return nearest;
  }

  /** Drags in the plane that faces the camera. */
  #drag(handle: Handle, start: PointerAt): Stroke {
    const { work, pane } = this;
    const grip = start.hit?.point ?? add(handle.pose.center, handle.pose.translation);
    const from = onPlane(pane.stage, start.ray, grip) ?? grip;
    const all = selectionOf(work.document, work.view.now);
    const show = (delta: Vector3, time: number) => work.during(shiftedTogether(work.document, all, delta), time);
    const snap = new DragSnap(work, pane, handle, movableOf(all), grip);
    return {
      move: (at) => {
        const to = onPlane(pane.stage, at.ray, grip);
        if (to) show(snap.apply(subtract(to, from), at), at.time);
      },
      end: () => work.endGesture(),
      cancel: () => work.cancelGesture(),
    };
  }

  #pose(pose: Pose): void {
    const { work } = this;
    const selection = selectionOf(work.document, work.view.now);
    if (selection.length > 0) work.during(posedTogether(work.document, selection, pose), performance.now());
  }

  #brushStroke(start: PointerAt): Stroke {
    const { work } = this;
    const touched = new Set<number>();
    const touch = (at: PointerAt) => {
      if (!at.hit) return;
      for (const vertex of this.#dabAt(at)) touched.add(vertex);
      work.facts.set({ pointedOut: ofVertices(this.#onBothSides([...touched])) });
    };
    touch(start);
    return {
      move: touch,
      end: () => {
        work.facts.set({ pointedOut: nothing });
        this.#select([...touched], modeOf(start, work));
      },
      cancel: () => work.facts.set({ pointedOut: nothing }),
    };
  }

  #paintStroke(start: PointerAt): Stroke {
    return new PaintStroke(this.work, this.pane, (at) => this.#dabAt(at), start);
  }

  #outlineStroke(start: PointerAt, toPolygon: (outline: number[]) => number[]): Stroke {
    const { pane } = this;
    const outline = [start.x, start.y];
    return {
      move: (at) => {
        outline.push(at.x, at.y);
        pane.overlay.show(toPolygon(outline));
      },
      end: () => {
        pane.overlay.show([]);
        const vertices = this.#inside(toPolygon(outline));
        if (vertices.length > 0) this.#select(vertices, modeOf(start, this.work));
        else this.work.notify("No vertex lies inside: draw around a part of the surface.");
      },
      cancel: () => pane.overlay.show([]),
    };
  }

  #inside(polygon: readonly number[]): number[] {
    const { stage } = this.pane;
    const { positions, mesh } = stage.surface!;
    const inside = insidePolygon(project(positions, viewProjection(stage), stage.width, stage.height), polygon);
    if (this.work.view.now.isThrough) return this.#withCopies(inside);
    const normals = vertexNormals(positions, mesh.faces);
    return this.#withCopies(facing(inside, positions, normals, stage.eye));
  }

  #select(vertices: readonly number[], mode: "new" | "add" | "release"): void {
    const { work } = this;
    const rest = work.mesh.positions;
    const before = work.document;
    const { selected } = work.view.now;
    if (mode === "release") return work.change(releaseVertices(before, this.#onBothSides(vertices), rest), true);
    const handle = handleOf(before, selected);
    if (mode === "add" && handle) return work.change(this.#extended(handle, vertices), true);
    const image = this.#imageOf(vertices);
    const isOnPlane = image.some((vertex) => vertices.includes(vertex));
    const after = this.#added(before, isOnPlane ? this.#onBothSides(vertices) : vertices);
    if (after === before) return work.notify("Another handle holds these vertices already.");
    work.change(isOnPlane ? after : this.#added(after, image), true);
    work.view.set({ selected: after.handles.at(-1)!.name });
  }

  #added(before: Document, vertices: readonly number[]): Document {
    const rest = this.work.mesh.positions;
    const { positions } = this.pane.stage.surface!;
    const current = isAtRest(positions, rest, vertices) ? rest : positions; // ignores differences that are only the rounding of frames
    return addHandle(before, vertices, rest, {}, current);
  }

  /** A handle on the plane of symmetry grows on both sides; another one grows on its own, and its partner on the other. */
  #extended(handle: Handle, vertices: readonly number[]): Document {
    const { document, mirror, mesh } = this.work;
    const partner = mirror && partnerOf(document.handles, handle, mirror);
    const own = partner === handle ? this.#onBothSides(vertices) : vertices;
    const grown = extendHandle(document, handle.name, own, mesh.positions);
    if (!partner || partner === handle) return grown;
    return extendHandle(grown, partner.name, this.#imageOf(vertices), mesh.positions);
  }
}

function modeOf(at: PointerAt, work: Workbench): "new" | "add" | "release" {
  if (at.shift) return "add";
  return at.alt ? "release" : work.view.now.mode;
}

function distanceTo(at: PointerAt, positions: Float32Array, vertex: number): number {
  const { origin } = at.ray;
  return Math.hypot(
    positions[3 * vertex]! - origin.x,
    positions[3 * vertex + 1]! - origin.y,
    positions[3 * vertex + 2]! - origin.z,
  );
}
