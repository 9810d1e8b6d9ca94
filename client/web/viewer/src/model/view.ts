import type { Encoding } from "lpdeform-client";
import type { Detail } from "./shapes.js";

export type Tool = "move" | "brush" | "lasso" | "box" | "paint";

/** What the colours show. */
export type ColourBy = "distortion" | "p" | "stiffness" | "normals" | "plain";

/** What a selecting stroke does: make a new handle, add to the selected one, or release vertices. */
export type StrokeMode = "new" | "add" | "release";

/** How the page is viewed and used. It is not part of the work and not undone. */
export interface View {
  tool: Tool;
  mode: StrokeMode;
  selected: string | undefined;
  gizmo: "translate" | "rotate";
  /** Of the brush, as a share of the mesh's diagonal. */
  radius: number;
  /** Whether lasso and box also take vertices that face away. */
  isThrough: boolean;
  paintField: "p" | "stiffness";
  paintP: number;
  paintStiffness: number;
  colourBy: ColourBy;
  wireframe: boolean;
  ghost: boolean;
  /** The distortion in full red, if the scale is pinned. */
  pinned: number | undefined;
  isSplit: boolean;
  isYUp: boolean;
  /** Whether vertices in the same place along seams count as one; see Seams. */
  isWelded: boolean;
  isDark: boolean;
  isPanelOpen: boolean;
  /** Whether letters, digits and signs are shortcuts. */
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
