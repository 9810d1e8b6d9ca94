import type { Vector3 } from "lpdeform-client/mesh/mesh";

export type AxisView = "front" | "right" | "top" | "back" | "left" | "bottom";

/** In the order in which a key goes through them. */
export const axisViews: readonly AxisView[] = ["front", "right", "top", "back", "left", "bottom"];

/** Where the viewer is, as seen from the mesh, with z up. */
const places: Readonly<Record<AxisView, Vector3>> = {
  front: [0, -1, 0],
  right: [1, 0, 0],
  top: [0, 0, 1],
  back: [0, 1, 0],
  left: [-1, 0, 0],
  bottom: [0, 0, -1],
};

/** The direction from the mesh to the viewer, along an axis of the mesh. */
export function directionOf(view: AxisView, isYUp: boolean): Vector3 {
  const [x, y, z] = places[view];
  return isYUp ? [x, z, -y || 0] : [x, y, z];
}

/** The view after the one that looks along this direction, which is of any length; the first after any other. */
export function viewAfter(direction: Vector3, isYUp: boolean): AxisView {
  const length = Math.hypot(...direction);
  const isAlong = (view: AxisView) =>
    directionOf(view, isYUp).reduce((sum, value, axis) => sum + value * direction[axis]!, 0) > 0.9999 * length;
  return axisViews[(axisViews.findIndex(isAlong) + 1) % axisViews.length]!;
}
