import * as three from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { conjugate, isAtRest, noRotation, noScale, type Pose, product, type Quaternion, scaled } from "../model/pose.js";
import { onGrid, onTurnedGrid, scaleStep, turnStep } from "../model/snap.js";
import type { GizmoAxes, GizmoMode } from "../model/view.js";

/** Of the pointer to the right and up, for a scale of e along all axes. */
const pixelsPerE = 200;

/** Arrows, rings or cubes on the selected handle. */
export class Gizmo {
  /** Called with each pose during a drag. */
  onPose: (pose: Pose) => void = () => undefined;
  onDragging: (isDragging: boolean) => void = () => undefined;
  onEnd: () => void = () => undefined;
  /** The drag was cancelled: it must have no effect. */
  onCancel: () => void = () => undefined;
  readonly #anchor = new three.Object3D();
  readonly #controls: TransformControls;
  #pose: Pose | undefined;
  #isCancelled = false;
  #axes: GizmoAxes = "world";
  #step: number | undefined;
  /** How the gizmo's axes are turned at the start of a drag. */
  #frame = noRotation;
  #camera: three.Camera;
  /** Where it was pressed, and where it is, in pixels of the page. */
  #pointer: [readonly [number, number], readonly [number, number]] = [
    [0, 0],
    [0, 0],
  ];

  constructor(camera: three.Camera, canvas: HTMLCanvasElement, changed: () => void) {
    this.#camera = camera;
    this.#controls = new TransformControls(camera, canvas);
    this.object.add(this.#controls.getHelper(), this.#anchor);
    removeBackwardArrows(this.#controls.getHelper());
    for (const kind of ["pointerdown", "pointermove"] as const) {
      const follow = ({ clientX, clientY }: PointerEvent) => {
        const at = [clientX, clientY] as const;
        this.#pointer = [kind === "pointerdown" ? at : this.#pointer[0], at];
      };
      canvas.addEventListener(kind, follow, { capture: true });
    }
    // The browser has taken the pointer; three.js listens only for a pointer that is released.
    canvas.addEventListener("pointercancel", () => this.cancel());
    this.#controls.setSize(0.72);
    this.#controls.addEventListener("change", changed);
    this.#controls.addEventListener("dragging-changed", ({ value }) => {
      this.onDragging(value === true);
      if (value === true) return;
      if (this.#isCancelled) this.onCancel();
      else this.onEnd();
    });
    this.#controls.addEventListener("objectChange", () => this.#moved());
  }

  /** Drawn with the rest of the scene. */
  readonly object = new three.Group();

  get isDragging(): boolean {
    return this.#controls.dragging;
  }

  /** Whether the pointer is on it. */
  get isHot(): boolean {
    return this.#controls.axis !== null && this.#controls.object !== undefined;
  }

  /** Cancels a drag; until the pointer is released it moves nothing. False if there is no drag. */
  cancel(): boolean {
    if (!this.isDragging) return false;
    this.#isCancelled = true;
    this.#controls.dragging = false;
    this.#isCancelled = false;
    this.#controls.axis = null;
    return true;
  }

  /** Undefined: no handle is selected, or it cannot be moved. `step`: of the grid to which it keeps, if there is one. */
  show(pose: Pose | undefined, mode: GizmoMode, axes: GizmoAxes = "world", step?: number): void {
    this.#controls.setMode(mode);
    if (this.isDragging) return;
    this.#pose = pose;
    this.#axes = mode === "scale" ? "local" : axes;
    this.#step = step;
    this.#controls.setRotationSnap(step === undefined ? null : (turnStep * Math.PI) / 180);
    this.#controls.setScaleSnap(step === undefined ? null : scaleStep);
    if (!pose) {
      this.#controls.detach();
      return;
    }
    const { center, translation } = pose;
    this.#anchor.position.set(center[0] + translation[0], center[1] + translation[1], center[2] + translation[2]);
    this.#anchor.scale.set(...(pose.scale ?? noScale));
    this.#turnAnchor();
    if (this.#controls.object !== this.#anchor) this.#controls.attach(this.#anchor);
    this.#controls.setSpace(this.#axes === "world" ? "world" : "local");
  }

  lookThrough(camera: three.Camera): void {
    this.#camera = camera;
    this.#controls.camera = camera;
  }

  /** Before each picture: the axes of the picture turn with the view. */
  follow(): void {
    if (this.#pose && this.#axes === "view" && !this.isDragging) this.#turnAnchor();
  }

  #turnAnchor(): void {
    if (this.#axes === "view") this.#anchor.quaternion.copy(this.#camera.quaternion);
    else this.#anchor.quaternion.set(...this.#pose!.rotation);
    this.#frame = this.#anchor.quaternion.toArray() as unknown as Quaternion;
    this.#anchor.updateMatrixWorld();
  }

  dispose(): void {
    this.#controls.dispose();
  }

  #moved(): void {
    if (!this.#pose) return;
    const { center, translation: before, rotation: from } = this.#pose;
    const { position, quaternion, scale } = this.#anchor;
    if (this.#controls.mode === "scale") {
      return this.onPose(scaled(this.#pose, this.#controls.axis === "XYZ" ? this.#grown() : scale.toArray()));
    }
    const to: Vector3 = [position.x - center[0], position.y - center[1], position.z - center[2]];
    const translation = this.#step === undefined ? to : this.#snapped(before, to, this.#step);
    position.set(center[0] + translation[0], center[1] + translation[1], center[2] + translation[2]);
    // The anchor is turned as the gizmo's axes are; what the drag has added to that turns the handle.
    const added = product(quaternion.toArray() as unknown as Quaternion, conjugate(this.#frame));
    const pose: Pose = { ...this.#pose, translation, rotation: product(added, from) };
    this.onPose(isAtRest(pose) ? { ...pose, translation: [0, 0, 0] } : pose);
  }

  /** Where three.js would scale by the distance from the middle, in which the pointer has taken the cube. */
  #grown(): Vector3 {
    const [[x0, y0], [x1, y1]] = this.#pointer;
    const factor = Math.exp((x1 - x0 + y0 - y1) / pixelsPerE);
    const [x, y, z] = this.#pose!.scale ?? noScale;
    const kept = (value: number) => (this.#step === undefined ? value : Math.max(Math.round(value / scaleStep), 1) * scaleStep);
    return [kept(factor * x), kept(factor * y), kept(factor * z)];
  }

  #snapped(before: Vector3, to: Vector3, step: number): Vector3 {
    if (this.#controls.mode !== "translate") return before;
    return this.#axes === "world" ? onGrid(before, to, step) : onTurnedGrid(before, to, step, this.#frame);
  }
}

/** One arrow per axis is enough to show its direction. */
function removeBackwardArrows(helper: three.Object3D): void {
  const backward: three.Object3D[] = [];
  helper.traverse((object) => {
    if (!(object instanceof three.Mesh) || !["X", "Y", "Z"].includes(object.name)) return;
    const geometry = object.geometry as three.BufferGeometry;
    geometry.computeBoundingBox();
    const { min, max } = geometry.boundingBox!;
    if (min.x + min.y + min.z < -0.2 && Math.max(max.x, max.y, max.z) < 0.2) backward.push(object);
  });
  for (const object of backward) object.removeFromParent();
}
