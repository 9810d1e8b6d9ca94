import type { Adjacency } from "../model/adjacency.js";
import type { Drawn } from "../model/drawn.js";
import { blockBoxes } from "../model/face_blocks.js";
import { pullOf } from "../model/pull.js";
import { type EnergyStatistics, energyStatistics } from "../model/statistics.js";
import { DrawMesh } from "./drawmesh.js";

/** A frame as it is drawn: arrays of the drawn vertices. */
export interface Intake {
  positions: Float32Array;
  normals: Float32Array;
  distortion: Float32Array;
  statistics: EnergyStatistics;
  /** See blockBoxes(). */
  boxes: Float32Array;
}

/** A mesh whose frames come. */
export interface IntakeMesh {
  /** The mesh's own positions and faces. */
  positions: Float32Array;
  faces: Uint32Array;
  /** Those that are shaded, if these are others. */
  drawn: Drawn;
  adjacency: Adjacency;
  order: Uint32Array;
}

/** The vertices that a handle pulls, and those that others hold. */
export interface PullRequest {
  pulled: readonly number[];
  held: readonly number[];
}

/** What is taken of a frame. */
export interface TakenFrame {
  readonly positions: Float32Array;
  readonly distortion: Float32Array;
}

export type IntakeRequest = IntakeMesh | { frame: TakenFrame } | { pull: PullRequest };
export type IntakeAnswer = Intake | { pull: Float32Array };

/** Finds what is drawn of frames, in new arrays. */
export class Taking {
  readonly #draw: DrawMesh;

  constructor(readonly mesh: IntakeMesh) {
    const { positions, faces, drawn } = mesh;
    this.#draw = new DrawMesh({ positions, faces }, drawn);
  }

  /** See pullOf(). */
  pull({ pulled, held }: PullRequest): Float32Array {
    const { positions, adjacency } = this.mesh;
    return pullOf(positions, adjacency, pulled, held);
  }

  take({ positions, distortion }: TakenFrame): Intake {
    const draw = this.#draw;
    const { faces, order } = this.mesh;
    draw.take(positions);
    const values = new Float32Array(draw.source.length);
    draw.spread(distortion, values);
    return {
      positions: draw.positions.slice(),
      normals: draw.normals.slice(),
      distortion: values,
      statistics: energyStatistics(distortion),
      boxes: blockBoxes(positions, faces, order),
    };
  }
}

/** From this number of vertices on, a page is busy for more than some milliseconds with a frame. */
const largeVertices = 20_000;

/** Takes the frames of a large mesh in a worker, one at a time. */
export class IntakeWorker {
  readonly #worker: Worker;
  #frame: ((intake: Intake | undefined) => void) | undefined;
  readonly #pulls: ((shares: Float32Array | undefined) => void)[] = [];
  #isBroken = false;

  private constructor(mesh: IntakeMesh) {
    this.#worker = new Worker(new URL("./intake_worker.ts", import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }: MessageEvent<IntakeAnswer>) => {
      if ("pull" in data) this.#pulls.shift()?.(data.pull);
      else this.#done(data);
    };
    this.#worker.onerror = () => this.stop();
    this.#worker.postMessage(mesh);
  }

  /** Undefined if the page takes them itself: the mesh is small, or the page can have no worker. */
  static start(mesh: IntakeMesh): IntakeWorker | undefined {
    if (mesh.positions.length < 3 * largeVertices) return undefined;
    try {
      return new IntakeWorker(mesh);
    } catch {
      return undefined;
    }
  }

  /** Undefined if the worker is broken or stopped. */
  take({ positions, distortion }: TakenFrame): Promise<Intake | undefined> {
    if (this.#isBroken) return Promise.resolve(undefined);
    this.#worker.postMessage({ frame: { positions, distortion } });
    return new Promise((answer) => (this.#frame = answer));
  }

  /** See pullOf(). Undefined if the worker is broken or stopped. */
  pull({ pulled, held }: PullRequest): Promise<Float32Array | undefined> {
    if (this.#isBroken) return Promise.resolve(undefined);
    this.#worker.postMessage({ pull: { pulled, held } });
    return new Promise((answer) => this.#pulls.push(answer));
  }

  stop(): void {
    this.#worker.terminate();
    this.#isBroken = true;
    this.#done(undefined);
    for (const answer of this.#pulls.splice(0)) answer(undefined);
  }

  #done(intake: Intake | undefined): void {
    this.#frame?.(intake);
    this.#frame = undefined;
  }
}
