import type { Side } from "../model/changes.js";

/** Where style/small.css lays the two pictures one above the other. */
const isUpright = matchMedia("(max-aspect-ratio: 1/1) and (max-width: 900px)");

/** What people call the places of two pictures. */
export function placeOf(side: Side): "left" | "right" | "upper" | "lower" {
  if (isUpright.matches) return side === "first" ? "upper" : "lower";
  return side === "first" ? "left" : "right";
}

/** When they move from beside each other to above each other, or back. */
export function watchPlaces(moved: () => void): void {
  isUpright.addEventListener("change", moved);
}
