import * as three from "three";
import type { Pose } from "../model/pose.js";
import type { Gizmo } from "./gizmo.js";

/** A gizmo whose code is loaded when a handle is first selected: the first picture needs none of it. */
export class LateGizmo {
  onPose: Gizmo["onPose"] = () => undefined;
  onDragging: Gizmo["onDragging"] = () => undefined;
  onEnd: Gizmo["onEnd"] = () => undefined;
  onCancel: Gizmo["onCancel"] = () => undefined;
  /** Drawn with the rest of the scene. */
  readonly object = new three.Group();
  #gizmo: Gizmo | undefined;
  #loading: Promise<void> | undefined;
  #shown: Parameters<Gizmo["show"]> | undefined;
  #isOver = false;

  /** `loaded`: called once it listens to the canvas, after everything that was there before. */
  constructor(
    public camera: three.Camera,
    readonly canvas: HTMLCanvasElement,
    readonly changed: () => void,
    readonly loaded: () => void,
  ) {}

  get isDragging(): boolean {
    return this.#gizmo?.isDragging ?? false;
  }

  get isHot(): boolean {
    return this.#gizmo?.isHot ?? false;
  }

  cancel(): boolean {
    return this.#gizmo?.cancel() ?? false;
  }

  show(pose: Pose | undefined, ...rest: Parameters<Gizmo["show"]> extends [unknown, ...infer Rest] ? Rest : never): void {
    this.#shown = [pose, ...rest];
    if (this.#gizmo) this.#gizmo.show(...this.#shown);
    else if (pose) this.#loading ??= this.#load();
  }

  lookThrough(camera: three.Camera): void {
    this.camera = camera;
    this.#gizmo?.lookThrough(camera);
  }

  follow(): void {
    this.#gizmo?.follow();
  }

  dispose(): void {
    this.#isOver = true;
    this.#gizmo?.dispose();
  }

  /** If it cannot be loaded, because the network or the server is away, the next call of show() tries again. */
  async #load(): Promise<void> {
    try {
      const { Gizmo } = await import("./gizmo.js");
      if (this.#isOver) return;
      const gizmo = new Gizmo(this.camera, this.canvas, this.changed);
      gizmo.onPose = (pose) => this.onPose(pose);
      gizmo.onDragging = (isDragging) => this.onDragging(isDragging);
      gizmo.onEnd = () => this.onEnd();
      gizmo.onCancel = () => this.onCancel();
      this.#gizmo = gizmo;
      this.object.add(gizmo.object);
      this.loaded();
      gizmo.show(...this.#shown!);
      this.changed();
    } catch {
      this.#loading = undefined;
    }
  }
}
