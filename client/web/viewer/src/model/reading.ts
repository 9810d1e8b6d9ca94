import type { Document } from "./document.js";
import { short } from "./words.js";

/** What is known of a vertex, in words. `p`: where it is not painted, undefined if it is not known; `distortion`: undefined before the first result. */
export function readingOf(document: Document, p: number | undefined, distortion: number | undefined, vertex: number): string {
  const { isAutomatic, paintedP, stiffness } = document;
  const painted = paintedP?.[vertex] ?? NaN;
  const parts = [`Vertex ${vertex}`, `distortion ${short(distortion ?? NaN)}`];
  if (p !== undefined) parts.push(isAutomatic ? "p from the shape" : `p ${short(Number.isNaN(painted) ? p : painted)}`);
  if (stiffness && !isAutomatic) parts.push(`stiffness ${short(stiffness[vertex]!)}`);
  return parts.join(" · ");
}
