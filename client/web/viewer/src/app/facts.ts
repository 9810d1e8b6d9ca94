import type { LpdeformError, MeshReport } from "lpdeform-client";
import { say, type Status } from "../link/status.js";
import { type Document, emptyDocument } from "../model/document.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { nothing, type PointedOut } from "../model/pointed.js";
import type { AsideName } from "./asides.js";

/** What the page says of the solve: nothing, how much of the energy's descent is left, or that it has just ended. */
export type Solving = { left: number } | "ended" | undefined;

/** What the page shows besides the pictures. */
export interface Facts {
  document: Document;
  mesh: Mesh;
  report: MeshReport | undefined;
  status: Status;
  /** The p of what the first picture shows in place of the server's frames, while the blend slider is held. */
  previewP: number | undefined;
  /** Whether poses are being exported. */
  isFilming: boolean;
  /** How the solve goes on for which the user waits. */
  solving: Solving;
  /** Why the newest change cannot be shown. */
  problem: LpdeformError | undefined;
  /** One line that disappears by itself, or stays until its cause is over. */
  notice: { text: string; isBad: boolean; stays?: boolean } | undefined;
  /** For each pane whose shape has a better one that the user may take: the share of energy that this saves. */
  better: readonly number[];
  /** When the work that a reload has restored was kept, as Date.now(). */
  restoredFrom: number | undefined;
  /** Works that were set aside, the newest first; bringBack() swaps one with the present work. */
  setAside: readonly AsideName[];
  /** What a brush or a warning highlights. */
  pointedOut: PointedOut;
  canUndo: boolean;
  canRedo: boolean;
  /** Vertices that coincide with others along seams, welded or not. */
  seamVertices: number;
  /** Vertices on open borders that lie near others and are not one with them. */
  looseVertices: number;
}

export const noMesh: Mesh = { name: "", positions: new Float32Array(0), faces: new Uint32Array(0) };

export const firstFacts: Facts = {
  document: emptyDocument,
  mesh: noMesh,
  report: undefined,
  status: say("idle", ""),
  previewP: undefined,
  isFilming: false,
  solving: undefined,
  problem: undefined,
  notice: undefined,
  better: [],
  restoredFrom: undefined,
  setAside: [],
  pointedOut: nothing,
  canUndo: false,
  canRedo: false,
  seamVertices: 0,
  looseVertices: 0,
};
