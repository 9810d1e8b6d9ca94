import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { add, conjugate, type Quaternion, rotate, subtract } from "./pose.js";

/** What a handle that is dragged keeps to. */
export type Snapping = "none" | "grid" | "vertices";

/** Of a turn, in degrees. */
export const turnStep = 15;
/** Of a scale. */
export const scaleStep = 0.1;
/** How far from the pointer a vertex may be that a drag goes to, in pixels. */
export const reachPixels = 18;

/** The distance between lines of the grid: 1, 2 or 5 times a power of ten, about a fiftieth of the mesh's diagonal. */
export function gridStep(diagonal: number): number {
  const wanted = diagonal / 50;
  const power = 10 ** Math.floor(Math.log10(wanted));
  const factor = [1, 2, 5, 10].findLast((one) => one * power <= wanted * (1 + 1e-9)) ?? 1;
  return factor * power;
}

/** The translation with each value that has changed rounded to the grid. */
export function onGrid(before: Vector3, after: Vector3, step: number): Vector3 {
  const round = (axis: 0 | 1 | 2) => (after[axis] === before[axis] ? after[axis] : rounded(after[axis], step));
  return [round(0), round(1), round(2)];
}

/** Like onGrid() along axes that are turned by `frame`: by how much it has moved along each is rounded. */
export function onTurnedGrid(before: Vector3, after: Vector3, step: number, frame: Quaternion): Vector3 {
  const [x, y, z] = rotate(conjugate(frame), subtract(after, before));
  return add(before, rotate(frame, [rounded(x, step), rounded(y, step), rounded(z, step)]));
}

function rounded(value: number, step: number): number {
  return Number((Math.round(value / step) * step).toPrecision(12)) || 0;
}

/**
 * The index of the place that is nearest to x and y on the screen, within reachPixels; undefined if there is none. `screen`: x
 * and y of each place; NaN for those that do not count.
 */
export function nearestTo(screen: Float32Array, x: number, y: number): number | undefined {
  let [nearest, least]: [number | undefined, number] = [undefined, reachPixels];
  for (let k = 0; 2 * k < screen.length; ++k) {
    const far = Math.hypot(screen[2 * k]! - x, screen[2 * k + 1]! - y);
    if (!(far < least)) continue;
    least = far;
    nearest = k;
  }
  return nearest;
}
