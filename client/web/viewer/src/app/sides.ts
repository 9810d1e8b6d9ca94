import type { Side } from "../model/changes.js";

/** Whether style/small.css places the two pictures one above the other. */
const isUpright = matchMedia("(max-aspect-ratio: 1/1) and (max-width: 900px)");

/** The words for the places of two pictures. */
export function placeOf(side: Side): "left" | "right" | "upper" | "lower" {
  if (isUpright.matches) return side === "first" ? "upper" : "lower";
  return side === "first" ? "left" : "right";
}

/** Calls `moved` when the pictures change between side by side and one above the other. */
export function watchPlaces(moved: () => void): void {
  isUpright.addEventListener("change", moved);
}
