import type { Vector3 } from "lpdeform-client/mesh/mesh";

/** Whether it is x, y and z of a place that can be drawn. */
export function isPlace(json: unknown): json is Vector3 {
  return Array.isArray(json) && json.length === 3 && json.every((value) => Number.isFinite(value) && Math.abs(value) < 1e19);
}
