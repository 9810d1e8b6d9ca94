import type { Adjacency } from "lpdeform-client/mesh/adjacency";
import type { Document, Handle } from "../model/document.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import type { Mirror } from "../model/mirror.js";
import type { Seams } from "lpdeform-client/mesh/seams";
import type { State } from "../model/state.js";
import type { View } from "../model/view.js";
import type { Facts } from "./facts.js";

/** What the tools work on: the mesh, the document, and the view. */
export interface Workbench {
  readonly view: State<View>;
  readonly facts: State<Facts>;
  readonly mesh: Mesh;
  readonly document: Document;
  readonly adjacency: Adjacency;
  /** Which vertices count as one, if any do. */
  readonly seams: Seams | undefined;
  /** Of the mesh's bounding box. */
  readonly diagonal: number;
  /** What is on the other side, if work is done on both. */
  readonly mirror: Mirror | undefined;

  /** Whether it is somebody else's work, which is not changed here. */
  readonly isWatching: boolean;

  /** Makes a step that can be undone. What changes of handles changes on the other side, too, unless it is whole as it is. */
  change(document: Document, isWhole?: boolean): void;
  /** A part of a gesture, from an input at `time`; endGesture() makes a step of all parts. Mirrored like change(). */
  during(document: Document, time: number, isWhole?: boolean): void;
  endGesture(): void;
  /** Reverts what the present gesture has changed, without a step. False if there is no gesture. */
  cancelGesture(): boolean;
  /** Whether the handle can be dragged to another place; if not, tells the user why. */
  canShift(handle: Handle): boolean;
  /** Shows the user one line. */
  notify(text: string): void;
}
