import type { Side } from "../model/changes.js";

// Where style/small.css places the two pictures: one above the other if the window is upright, unless it is narrow and the panel is open.
const isUpright = matchMedia("(max-aspect-ratio: 1/1) and (max-width: 900px)");
const isNarrow = matchMedia("(max-width: 720px)");
let isPanelOpen = false;

const watchers: (() => void)[] = [];
const tell = () => watchers.forEach((moved) => moved());
isUpright.addEventListener("change", tell);
isNarrow.addEventListener("change", tell);

export function panelIs(isOpen: boolean): void {
  if (isOpen === isPanelOpen) return;
  isPanelOpen = isOpen;
  tell();
}

/** The words for the places of two pictures. */
export function placeOf(side: Side): "left" | "right" | "upper" | "lower" {
  if (isUpright.matches && !(isNarrow.matches && isPanelOpen)) return side === "first" ? "upper" : "lower";
  return side === "first" ? "left" : "right";
}

/** Calls `moved` when the pictures may change between side by side and one above the other. */
export function watchPlaces(moved: () => void): void {
  watchers.push(moved);
}
