import * as three from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { isAtRest, type Pose, type Quaternion } from "../model/pose.js";

/** Arrows and rings on the selected handle. */
export class Gizmo {
  /** What it does to the pose, while it does it. */
  onPose: (pose: Pose) => void = () => undefined;
  onDragging: (isDragging: boolean) => void = () => undefined;
  onEnd: () => void = () => undefined;
  /** It was let go of in the middle: nothing of what it did is to stay. */
  onCancel: () => void = () => undefined;
  readonly #anchor = new three.Object3D();
  readonly #controls: TransformControls;
  #pose: Pose | undefined;
  #isCancelled = false;

  constructor(camera: three.Camera, canvas: HTMLCanvasElement, changed: () => void) {
    this.#controls = new TransformControls(camera, canvas);
    this.object.add(this.#controls.getHelper(), this.#anchor);
    removeBackwardArrows(this.#controls.getHelper());
    // The browser has taken the pointer; its own listeners know only of one that is let go.
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

  /** To be drawn with the rest. */
  readonly object = new three.Group();

  get isDragging(): boolean {
    return this.#controls.dragging;
  }

  /** Whether the pointer is on it. */
  get isHot(): boolean {
    return this.#controls.axis !== null && this.#controls.object !== undefined;
  }

  /** Lets go in the middle of a drag; what the pointer does until it is up moves nothing. False where there is none. */
  cancel(): boolean {
    if (!this.isDragging) return false;
    this.#isCancelled = true;
    this.#controls.dragging = false;
    this.#isCancelled = false;
    this.#controls.axis = null;
    return true;
  }

  /** Nothing: no handle is selected, or it cannot be moved. */
  show(pose: Pose | undefined, mode: "translate" | "rotate"): void {
    this.#controls.setMode(mode);
    if (this.isDragging) return;
    this.#pose = pose;
    if (!pose) {
      this.#controls.detach();
      return;
    }
    const { center, translation, rotation } = pose;
    this.#anchor.position.set(center[0] + translation[0], center[1] + translation[1], center[2] + translation[2]);
    this.#anchor.quaternion.set(...rotation);
    this.#anchor.updateMatrixWorld();
    if (this.#controls.object !== this.#anchor) this.#controls.attach(this.#anchor);
    this.#controls.setSpace("world");
  }

  dispose(): void {
    this.#controls.dispose();
  }

  #moved(): void {
    if (!this.#pose) return;
    const { center } = this.#pose;
    const { position, quaternion } = this.#anchor;
    const translation = [position.x - center[0], position.y - center[1], position.z - center[2]] as const;
    const pose: Pose = { center, translation, rotation: quaternion.toArray() as unknown as Quaternion };
    this.onPose(isAtRest(pose) ? { ...pose, translation: [0, 0, 0] } : pose);
  }
}

/** One arrow an axis is enough to see which way it points. */
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
