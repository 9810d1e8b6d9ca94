import { nothing, ofVertices } from "../model/pointed.js";
import { type Brush, paintSoftly, strengthAt } from "../model/soft_paint.js";
import type { PointerAt, Stroke } from "../stage/pointing.js";
import { largeVertices } from "../stage/surface.js";
import type { Pane } from "./pane.js";
import type { Workbench } from "./workbench.js";

/** A stroke of the brush that paints p or stiffness. It is seen while it goes on, and is one step when it ends. */
export class PaintStroke implements Stroke {
  /** For each vertex the most that any place of the stroke has worked on it. */
  readonly #strengths = new Map<number, number>();
  readonly #before;
  readonly #brush: Brush;
  /** Places of a large mesh, which are painted in a task of their own: that of the pointer draws a picture as well. */
  #ahead: PointerAt[] = [];
  #task: ReturnType<typeof setTimeout> | undefined;

  /** `dabAt`: the vertices under the brush. */
  constructor(
    readonly work: Workbench,
    readonly pane: Pane,
    readonly dabAt: (at: PointerAt) => readonly number[],
    start: PointerAt,
  ) {
    const { paintField, paintMode, paintP, paintStiffness } = work.view.now;
    this.#before = work.document;
    this.#brush = { field: paintField, mode: paintMode, value: paintField === "p" ? paintP : paintStiffness };
    work.view.set({ colourBy: paintField });
    this.move(start);
  }

  move(at: PointerAt): void {
    if (!at.hit) return;
    this.#ahead.push(at);
    if (this.work.mesh.positions.length < 3 * largeVertices) this.flush();
    else this.#task ??= setTimeout(() => this.flush());
  }

  /** Paints the places that wait. */
  flush(): void {
    clearTimeout(this.#task);
    this.#task = undefined;
    const places = this.#ahead;
    if (places.length === 0) return;
    this.#ahead = [];
    const { work } = this;
    const { adjacency, seams } = work;
    const pointedOut = new Set<number>();
    for (const at of places) {
      for (const [vertex, strength] of this.#strengthsAt(at)) {
        pointedOut.add(vertex);
        if (strength > (this.#strengths.get(vertex) ?? 0)) this.#strengths.set(vertex, strength);
      }
    }
    work.facts.set({ pointedOut: ofVertices([...pointedOut]) });
    const count = work.mesh.positions.length / 3;
    work.during(paintSoftly(this.#before, this.#strengths, this.#brush, count, adjacency, seams?.groups), places.at(-1)!.time);
  }

  #strengthsAt(at: PointerAt): Map<number, number> {
    const { mirror, seams } = this.work;
    const dab = this.dabAt(at);
    const strengths = new Map(dab.map((vertex) => [vertex, this.#strengthOf(vertex, at.hit!.point)]));
    for (const [image, vertex] of mirror?.imagesOf(dab) ?? []) {
      for (const copy of seams?.withCopies([image]) ?? [image]) {
        strengths.set(copy, Math.max(strengths.get(vertex)!, strengths.get(copy) ?? 0));
      }
    }
    return strengths;
  }

  #strengthOf(vertex: number, point: readonly number[]): number {
    const { radius, softness } = this.work.view.now;
    const { positions } = this.pane.stage.surface!;
    const far = Math.hypot(...point.map((value, axis) => positions[3 * vertex + axis]! - value));
    return radius === 0 ? 1 : strengthAt(far / (radius * this.work.diagonal), softness);
  }

  end(): void {
    this.flush();
    this.work.facts.set({ pointedOut: nothing });
    this.work.endGesture();
  }

  cancel(): void {
    clearTimeout(this.#task);
    this.#ahead = [];
    this.work.facts.set({ pointedOut: nothing });
    this.work.cancelGesture();
  }
}
