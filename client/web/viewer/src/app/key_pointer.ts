import { boundsOf } from "lpdeform-client/mesh/mesh";
import { project } from "../model/selection.js";
import { viewProjection } from "../stage/pointing.js";
import type { Pane } from "./pane.js";

const directions: Record<string, readonly [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
/** Of the picture's height; with Shift one pixel. */
const stepShare = 0.02;

export interface KeyPointerTarget {
  /** The cross is there; undefined if it is hidden. */
  hover(event: PointerEvent | undefined): void;
  /** Enter was pressed. Returns true if it has had an effect and the cross may be hidden. */
  press(event: PointerEvent): boolean;
}

/** A cross on a picture that replaces the pointer: Enter shows it and then presses, arrow keys move it, Escape hides it. */
export class KeyPointer {
  readonly element = document.createElement("div");
  #at: readonly [number, number] | undefined;

  constructor(
    readonly pane: Pane,
    readonly target: KeyPointerTarget,
  ) {
    this.element.className = "cross";
    this.element.hidden = true;
    pane.element.append(this.element);
    const { canvas } = pane.stage;
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || !this.#take(event)) return;
      event.preventDefault();
      event.stopPropagation();
    });
    canvas.addEventListener("blur", () => this.#show(undefined));
    canvas.addEventListener("pointerdown", () => this.#show(undefined));
  }

  #take(event: KeyboardEvent): boolean {
    const { key } = event;
    const direction = directions[key];
    if (key === "Enter") this.#enter(event);
    else if (!this.#at) return false;
    else if (key === "Escape") this.#show(undefined);
    else if (direction) this.#move(direction, event.shiftKey ? 1 : stepShare * this.pane.stage.height, event);
    else return false;
    return true;
  }

  /** Once, however long the key is held. Without a surface there is nothing to press on. */
  #enter(event: KeyboardEvent): void {
    if (event.repeat || !this.pane.stage.surface) return;
    if (!this.#at) this.#show(this.#middle(), event);
    else if (this.target.press(this.#asPointer(this.#at, event))) this.#show(undefined);
  }

  /** The middle of the visible surface. */
  #middle(): readonly [number, number] {
    const { stage } = this.pane;
    const { positions, mesh } = stage.surface!;
    const [x, y] = project(
      Float32Array.from(boundsOf(positions, mesh.faces).center),
      viewProjection(stage),
      stage.width,
      stage.height,
    );
    return this.#inside(x!, y!);
  }

  #inside(x: number, y: number): readonly [number, number] {
    const { width, height } = this.pane.stage;
    return [Math.min(Math.max(x, 0), width - 1), Math.min(Math.max(y, 0), height - 1)];
  }

  #move([dx, dy]: readonly [number, number], step: number, event: KeyboardEvent): void {
    const [x, y] = this.#at!;
    this.#show(this.#inside(x + step * dx, y + step * dy), event);
  }

  #show(at: readonly [number, number] | undefined, event?: KeyboardEvent): void {
    if (!at && !this.#at) return;
    this.#at = at;
    this.element.hidden = !at;
    if (at) this.element.style.translate = `${at[0]}px ${at[1]}px`;
    this.target.hover(at && this.#asPointer(at, event));
  }

  #asPointer([x, y]: readonly [number, number], event?: KeyboardEvent): PointerEvent {
    const box = this.pane.stage.canvas.getBoundingClientRect();
    const { shiftKey = false, altKey = false } = event ?? {};
    return new PointerEvent("pointermove", { clientX: box.left + x, clientY: box.top + y, shiftKey, altKey });
  }
}
