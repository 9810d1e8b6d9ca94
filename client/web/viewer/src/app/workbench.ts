import type { Adjacency } from "../model/adjacency.js";
import type { Document, Handle } from "../model/document.js";
import type { Mesh } from "../model/mesh.js";
import type { Seams } from "../model/seams.js";
import type { State } from "../model/state.js";
import type { View } from "../model/view.js";
import type { Facts } from "./facts.js";

/** What the tools work on: the mesh, the document, and how they are looked at. */
export interface Workbench {
  readonly view: State<View>;
  readonly facts: State<Facts>;
  readonly mesh: Mesh;
  readonly document: Document;
  readonly adjacency: Adjacency;
  /** Which vertices are taken for one, where any are. */
  readonly seams: Seams | undefined;
  /** Of the box around the mesh. */
  readonly diagonal: number;

  /** A step that can be undone. */
  change(document: Document): void;
  /** Part of a gesture, made by an input at `time`; endGesture() makes a step of it. */
  during(document: Document, time: number): void;
  endGesture(): void;
  /** What the gesture has changed is as before, without a step. False where none is under way. */
  cancelGesture(): boolean;
  /** Whether the handle can be dragged to another place; where not, the user is told why. */
  canShift(handle: Handle): boolean;
  /** Shows the user one line. */
  notify(text: string): void;
}
