import type { Encoding, MinimaSearch } from "lpdeform-client";
import { usualWelding } from "lpdeform-client/mesh/derived";
import type { PaletteName } from "./palettes.js";
import type { Snapping } from "./snap.js";
import type { Symmetry } from "./mirror.js";
import type { PaintField, PaintMode } from "./soft_paint.js";
import type { Detail } from "./shapes.js";

export type Tool = "move" | "brush" | "lasso" | "box" | "paint";

export type GizmoMode = "translate" | "rotate" | "scale";

/** Along which axes the gizmo moves and turns: those of the mesh, of the handle, or of the picture. It scales along the handle's. */
export type GizmoAxes = "world" | "local" | "view";

/** What the colours show. */
export type ColourBy = "distortion" | "p" | "stiffness" | "normals" | "clay" | "texture" | "plain";

/** In the order of the page. */
export const colourings: readonly ColourBy[] = ["distortion", "p", "stiffness", "normals", "clay", "texture", "plain"];

/** What a selecting stroke does: make a new handle, add to the selected one, or release vertices. */
export type StrokeMode = "new" | "add" | "release";

/** How the page is viewed and used. It is not part of the work and not undone. */
export interface View {
  tool: Tool;
  mode: StrokeMode;
  selected: string | undefined;
  /** Other handles that are moved together with the selected one. Selecting another handle empties the list. */
  alsoSelected: readonly string[];
  gizmo: GizmoMode;
  axes: GizmoAxes;
  snapping: Snapping;
  /** Across which plane selecting, painting and moving handles is done on both sides. */
  symmetry: Symmetry;
  /** Of the brush, as a share of the mesh's diagonal. */
  radius: number;
  /** Whether lasso and box also take vertices that face away. */
  isThrough: boolean;
  paintField: PaintField;
  paintMode: PaintMode;
  /** Of the edge of the painting brush: 0 is hard, 1 is soft up to its middle. */
  softness: number;
  paintP: number;
  paintStiffness: number;
  colourBy: ColourBy;
  palette: PaletteName;
  /** Whether the values of the vertex under the pointer are shown. */
  hasReadout: boolean;
  wireframe: boolean;
  ghost: boolean;
  /** The distortion in full red, if the scale is pinned. */
  pinned: number | undefined;
  isSplit: boolean;
  isYUp: boolean;
  /** Whether it is drawn without perspective. */
  isParallel: boolean;
  /** Whether vertices in the same place along seams count as one; see Seams. */
  isWelded: boolean;
  /** How far apart they may be, as a share of the diagonal. */
  weldTolerance: number;
  isDark: boolean;
  isPanelOpen: boolean;
  /** Whether letters, digits and signs are shortcuts. */
  hasSingleKeys: boolean;
  detail: Detail;
  shape: string;
  encoding: Encoding;
  /** How far the server looks for lower minima while nothing changes. */
  search: MinimaSearch;
}

/** As the server decides. */
export const usualSearch: MinimaSearch = {};

export const firstView: View = {
  tool: "move",
  mode: "new",
  selected: undefined,
  alsoSelected: [],
  gizmo: "translate",
  axes: "world",
  snapping: "none",
  symmetry: "none",
  radius: 0.05,
  isThrough: true,
  paintField: "p",
  paintMode: "set",
  softness: 0,
  paintP: 1,
  paintStiffness: 10,
  colourBy: "distortion",
  palette: "blueToRed",
  hasReadout: true,
  wireframe: false,
  ghost: false,
  pinned: undefined,
  isSplit: false,
  isYUp: false,
  isParallel: false,
  isWelded: usualWelding.isOn,
  weldTolerance: usualWelding.tolerance,
  isDark: true,
  isPanelOpen: true,
  hasSingleKeys: true,
  detail: "medium",
  shape: "",
  encoding: "quantized",
  search: usualSearch,
};
