import type { LpdeformError, MeshReport } from "lpdeform-client";
import { say, type Status } from "../link/status.js";
import { type Document, emptyDocument } from "../model/document.js";
import type { Mesh } from "../model/mesh.js";
import { nothing, type PointedOut } from "../model/pointed.js";
import type { AsideName } from "./asides.js";

/** What the page shows beside the pictures. */
export interface Facts {
  document: Document;
  mesh: Mesh;
  report: MeshReport | undefined;
  status: Status;
  /** Why the newest change cannot be shown. */
  problem: LpdeformError | undefined;
  /** One line that goes by itself, or stays until what it tells of is over. */
  notice: { text: string; isBad: boolean; stays?: boolean } | undefined;
  /** When the work was kept that a reload has brought back, of Date.now(). */
  restoredFrom: number | undefined;
  /** Work whose place other work has taken, the newest first; bringBack() swaps them. */
  setAside: readonly AsideName[];
  /** What a brush or a warning points out. */
  pointedOut: PointedOut;
  canUndo: boolean;
  canRedo: boolean;
  /** Vertices that lie on others along seams, welded or not. */
  seamVertices: number;
}

export const noMesh: Mesh = { name: "", positions: new Float32Array(0), faces: new Uint32Array(0) };

export const firstFacts: Facts = {
  document: emptyDocument,
  mesh: noMesh,
  report: undefined,
  status: say("idle", ""),
  problem: undefined,
  notice: undefined,
  restoredFrom: undefined,
  setAside: [],
  pointedOut: nothing,
  canUndo: false,
  canRedo: false,
  seamVertices: 0,
};
