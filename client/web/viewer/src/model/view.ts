import type { Encoding } from "lpdeform-client";
import type { Detail } from "./shapes.js";

export type Tool = "move" | "brush" | "lasso" | "box" | "paint";

/** What the colours tell. */
export type ColourBy = "distortion" | "p" | "stiffness" | "normals" | "plain";

/** What a selecting stroke does: a new handle, more for the selected one, or letting go of vertices. */
export type StrokeMode = "new" | "add" | "release";

/** How the page is looked at and used: not part of the work, not undone. */
export interface View {
  tool: Tool;
  mode: StrokeMode;
  selected: string | undefined;
  gizmo: "translate" | "rotate";
  /** Of the brush, in shares of the mesh's diagonal. */
  radius: number;
  /** Lasso and box take vertices that face away, too. */
  isThrough: boolean;
  paintField: "p" | "stiffness";
  paintP: number;
  paintStiffness: number;
  colourBy: ColourBy;
  wireframe: boolean;
  ghost: boolean;
  /** The distortion in full red, where the scale is pinned. */
  pinned: number | undefined;
  isSplit: boolean;
  isYUp: boolean;
  /** Vertices in one place along seams are taken for one; see Seams. */
  isWelded: boolean;
  isDark: boolean;
  isPanelOpen: boolean;
  /** Letters, digits and signs are shortcuts. */
  hasSingleKeys: boolean;
  detail: Detail;
  shape: string;
  encoding: Encoding;
}

export const firstView: View = {
  tool: "move",
  mode: "new",
  selected: undefined,
  gizmo: "translate",
  radius: 0.05,
  isThrough: true,
  paintField: "p",
  paintP: 1,
  paintStiffness: 10,
  colourBy: "distortion",
  wireframe: false,
  ghost: false,
  pinned: undefined,
  isSplit: false,
  isYUp: false,
  isWelded: true,
  isDark: true,
  isPanelOpen: true,
  hasSingleKeys: true,
  detail: "medium",
  shape: "",
  encoding: "quantized",
};
