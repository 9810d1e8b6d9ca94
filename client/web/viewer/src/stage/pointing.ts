import * as three from "three";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import type { Hit } from "../model/raycast.js";
import type { Stage } from "./stage.js";

/** What pointing at a stage does. Positions are pixels from the canvas's upper left corner; times are those of the events. */
export interface PointingTarget {
  /** Takes a press, or leaves it to the view, which reports a click. */
  press(at: PointerAt): Stroke | undefined;
  /** A press that was not taken and did not move. */
  click(at: PointerAt): void;
  hover(at: PointerAt | undefined): void;
}

export interface PointerAt {
  x: number;
  y: number;
  time: number;
  isTouch: boolean;
  shift: boolean;
  alt: boolean;
  /** Control, or Command on a Mac. */
  control: boolean;
  ray: three.Ray;
  hit: Hit | undefined;
}

/** A press that was taken, until it is released. */
export interface Stroke {
  move(at: PointerAt): void;
  /** Does at once what waits for a task of its own. */
  flush?(): void;
  end(): void;
  /** A second finger came, or Escape. */
  cancel(): void;
}

/** How many pixels a finger or a mouse may move within a click. */
const clickSlack = { touch: 10, mouse: 4 };

/** Turns the events of a stage's canvas into strokes and clicks. Everything that is not taken changes the view. */
export class Pointing {
  isHandOver = false;
  #stroke: { pointer: number; stroke: Stroke; down: PointerEvent } | undefined;
  #press: { at: PointerAt; pointer: number } | undefined;
  /** While the space bar is held, every drag changes the view. */
  isViewOnly = false;

  constructor(
    readonly stage: Stage,
    readonly target: PointingTarget,
  ) {
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    canvas.addEventListener("pointerup", (event) => this.#up(event, true));
    canvas.addEventListener("pointercancel", (event) => this.#up(event, false));
    canvas.addEventListener("pointerleave", () => this.target.hover(undefined));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  get isBusy(): boolean {
    return this.#stroke !== undefined || this.#press !== undefined;
  }

  /** Of a stroke, or of a press that would become a click. False if there is neither. */
  cancel(): boolean {
    const taken = this.#stroke;
    const wasPressed = this.#press !== undefined;
    this.#stroke = this.#press = undefined;
    taken?.stroke.cancel();
    return taken !== undefined || wasPressed;
  }

  /** A stroke does what it has put off. */
  flush(): void {
    this.#stroke?.stroke.flush?.();
  }

  at(event: PointerEvent | MouseEvent): PointerAt {
    const box = this.stage.canvas.getBoundingClientRect();
    const x = event.clientX - box.left;
    const y = event.clientY - box.top;
    const { surface } = this.stage;
    const ray = this.stage.rayAt((2 * x) / box.width - 1, 1 - (2 * y) / box.height);
    let found: { hit: Hit | undefined } | undefined;
    return {
      x,
      y,
      time: event.timeStamp,
      isTouch: event instanceof PointerEvent && event.pointerType === "touch",
      shift: event.shiftKey,
      alt: event.altKey,
      control: event.ctrlKey || event.metaKey,
      ray,
      get hit() {
        found ??= {
          hit: surface?.hit(ray.origin.toArray(), ray.direction.toArray()),
        };
        return found.hit;
      },
    };
  }

  #down(event: PointerEvent): void {
    if (this.isHandOver) return;
    this.stage.canvas.focus({ preventScroll: true });
    if (this.#stroke && event.pointerId !== this.#stroke.pointer) return this.#handOver(this.#stroke.down);
    if (this.#press) {
      this.#press = undefined; // a second finger: no click
      return;
    }
    if (event.button !== 0 || this.isViewOnly || this.stage.gizmo.isDragging) return;
    if (this.stage.gizmo.isHot && event.pointerType !== "touch") return this.target.hover(undefined);
    const at = this.at(event);
    const stroke = this.target.press(at);
    if (stroke) {
      this.#stroke = { pointer: event.pointerId, stroke, down: event };
      this.stage.canvas.setPointerCapture(event.pointerId);
      event.stopImmediatePropagation();
    } else {
      this.#press = { at, pointer: event.pointerId };
    }
  }

  #move(event: PointerEvent): void {
    if (this.#stroke?.pointer === event.pointerId) {
      event.stopImmediatePropagation();
      this.#stroke.stroke.move(this.at(event));
    } else if (event.buttons === 0 && event.pointerType !== "touch") {
      this.target.hover(this.at(event));
    }
  }

  #up(event: PointerEvent, isDone: boolean): void {
    const taken = this.#stroke;
    if (taken?.pointer === event.pointerId) {
      this.#stroke = undefined;
      event.stopImmediatePropagation();
      if (isDone) taken.stroke.end();
      else taken.stroke.cancel();
      return;
    }
    const press = this.#press;
    this.#press = undefined;
    if (!press || press.pointer !== event.pointerId || !isDone) return;
    const at = this.at(event);
    const slack = at.isTouch ? clickSlack.touch : clickSlack.mouse;
    if (Math.hypot(at.x - press.at.x, at.y - press.at.y) <= slack) this.target.click(at);
  }

  /** Two fingers turn and zoom the view, even if the first has begun a stroke. */
  #handOver(first: PointerEvent): void {
    this.cancel();
    this.isHandOver = true;
    const { pointerId, pointerType, clientX, clientY, button, buttons } = first;
    const again = { pointerId, pointerType, clientX, clientY, button, buttons, bubbles: true, cancelable: true };
    this.stage.canvas.dispatchEvent(new PointerEvent("pointerdown", again));
    this.isHandOver = false;
  }
}

/** The point where a ray meets the plane through `point` that faces the camera. */
export function onPlane(stage: Stage, ray: three.Ray, point: Vector3): Vector3 | undefined {
  const normal = stage.camera.getWorldDirection(new three.Vector3());
  const plane = new three.Plane().setFromNormalAndCoplanarPoint(normal, new three.Vector3(...point));
  return ray.intersectPlane(plane, new three.Vector3())?.toArray();
}

export function viewProjection({ camera }: Stage): number[] {
  camera.updateMatrixWorld();
  return new three.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).toArray();
}
