import { type ErrorCode, type ErrorDetails, LpdeformError } from "../errors.js";
import type { Packed, Shaded, Unpacked, Weld } from "../types.js";
import { checkKeys } from "../key_checks.js";
import { checkWelding, type Derived, know, usualWelding, type Welding, weldOf } from "./derived.js";
import { Desk, type Opening, type PullRequest, type Questions, type Source } from "./desk.js";
import { FileFault } from "./fault.js";
import type { Mesh } from "./mesh.js";
import { Seams } from "./seams.js";
import type { Surface } from "./shaded.js";
import type { StoredMesh } from "./stored.js";

export interface ReadOptions {
  /** Files that a `.gltf` names, or the MTL and images of an OBJ (Mesh.materials). */
  beside?: readonly File[];
  /** Default: vertices on open borders are one within 1e-6 of the diagonal. */
  welding?: Welding;
}

/** What a worker is asked, and how it answers: with the answer, or why there is none. */
export type Question = {
  [Name in keyof Questions]: { id: number; name: Name; asked: Questions[Name][0] };
}[keyof Questions];
export type Answer = { id: number } & ({ answer: unknown } | { fault: string } | { error: ToldError });

/** An LpdeformError as a worker can tell it. */
export type ToldError = ErrorDetails & { code: ErrorCode; message: string };

/** Below this size a page is as quick by itself. */
const smallBytes = 200_000;

/** A reply is waited for. */
interface Waiting {
  /** Undefined if its memory was handed over, so it cannot be asked again. */
  question: Question | undefined;
  done: (answer: unknown) => void;
  failed: (error: unknown) => void;
}

/**
 * A mesh, what is needed to show it, and the worker that has found that and goes on with the frames of a session (`shading` of
 * openSession()). If the mesh is small, or the page can have no worker, or the worker ends by itself, the page does all that.
 */
export class OpenMesh {
  readonly mesh: Mesh;
  #derived: Derived;

  private constructor(
    readonly line: Line,
    source: Source,
    { mesh, derived }: Opening,
  ) {
    this.mesh = mesh ?? (source as { mesh: Mesh }).mesh;
    this.#derived = this.#know(derived);
    line.goOnWith(this.mesh);
  }

  /**
   * Rejects with a FileFault that names the place in the file, or with an LpdeformError: WELD_TOLERANCE, UNKNOWN_KEY, ARRAY_TYPE
   * or WELD_TOO_DENSE for `welding`.
   */
  static async from(source: Source, welding: Welding = usualWelding): Promise<OpenMesh> {
    checkWelding(welding);
    const line = Line.to(isLarge(source));
    try {
      return new OpenMesh(line, source, await line.ask("open", { ...source, welding }));
    } catch (thrown) {
      line.close();
      if (!(thrown instanceof WorkerGone) || !line.isWorker) throw thrown;
    }
    const here = Line.to(false);
    return new OpenMesh(here, source, await here.ask("open", { ...source, welding }));
  }

  /** Whether a worker answers. */
  get isInWorker(): boolean {
    return this.line.isWorker;
  }

  get derived(): Derived {
    return this.#derived;
  }

  /** For openSession(). */
  get sessionMesh(): { vertices: Float32Array | Float64Array; faces: Uint32Array } {
    const { positions, exact, faces } = this.mesh;
    return { vertices: exact ?? positions, faces };
  }

  /** For `weld` of openSession(). Undefined if no two vertices are one. */
  get weld(): Weld | undefined {
    return weldOf(this.#derived);
  }

  /** Finds again what is one. What is drawn changes with it. Rejects as from() does; then all stays as it was. */
  async reweld(welding: Welding): Promise<Derived> {
    checkWelding(welding);
    return (this.#derived = this.#know(await this.line.ask("weld", welding)));
  }

  /** For sessions. Rejects with a LpdeformError (FRAME_PARTS) if a block cannot be read. */
  unpack(packed: Packed): Promise<Unpacked & { shaded: Shaded }> {
    const bytes = packed.parts.flatMap(({ vertices, normals }) => [vertices.buffer, normals.buffer] as ArrayBuffer[]);
    return this.line.ask("unpack", packed, bytes);
  }

  /** What is drawn of a surface of this mesh. */
  shade({ positions, distortion }: Surface): Promise<Shaded> {
    return this.line.ask("shade", { positions, distortion });
  }

  /** See pullOf(). */
  pull({ pulled, held }: PullRequest): Promise<Float32Array> {
    return this.line.ask("pull", { pulled, held });
  }

  /** For the browser's database, and for OpenMesh.from(). */
  store(): Promise<StoredMesh> {
    return this.line.ask("store", undefined);
  }

  /** Ends the worker. What was asked and not answered is rejected. */
  close(): void {
    this.line.close();
  }

  #know(derived: Derived): Derived {
    const { seams } = derived;
    const whole = { ...derived, seams: seams && new Seams(seams.groups, seams.faces, seams.copyCount) }; // a worker's answer has no classes
    know(this.mesh, whole);
    return whole;
  }
}

/** Reads OBJ, OFF, PLY, STL, GLB or glTF by the ending of the file's name. Rejects as OpenMesh.from() does. */
export async function readMesh(file: File, options: ReadOptions = {}): Promise<OpenMesh> {
  checkKeys(options, { beside: true, welding: true } satisfies Record<keyof ReadOptions, true>, "options");
  const { beside = [], welding } = options;
  return OpenMesh.from({ file, beside }, welding);
}

function isLarge(source: Source): boolean {
  if ("mesh" in source) return source.mesh.positions.byteLength + source.mesh.faces.byteLength > smallBytes;
  if ("stored" in source) return source.stored.blob.size > smallBytes;
  return [source.file, ...source.beside].some(({ size }) => size > smallBytes);
}

/** The worker cannot be loaded, or has ended. */
class WorkerGone extends LpdeformError {
  constructor() {
    super("unavailable", "The mesh is closed, or its worker has ended.");
  }
}

/** Asks a desk: one in a worker, or one in the page. */
class Line {
  readonly #waiting = new Map<number, Waiting>();
  #worker: Worker | undefined;
  #desk: Desk | undefined;
  #mesh: Mesh | undefined;
  #lastId = 0;
  #isClosed = false;

  private constructor(worker: Worker | undefined) {
    this.#worker = worker;
    if (!worker) this.#desk = new Desk();
    else {
      worker.onmessage = ({ data }: MessageEvent<Answer>) => this.#take(data);
      worker.onerror = worker.onmessageerror = () => this.#workerEnded();
    }
  }

  static to(isWorkerWanted: boolean): Line {
    let worker: Worker | undefined;
    try {
      if (isWorkerWanted) worker = new Worker(new URL("./mesh_worker.js", import.meta.url), { type: "module" });
    } catch {
      worker = undefined;
    }
    return new Line(worker);
  }

  get isWorker(): boolean {
    return this.#worker !== undefined;
  }

  /** The mesh is open. If the worker ends, the page answers for it. */
  goOnWith(mesh: Mesh): void {
    this.#mesh = mesh;
  }

  ask<Name extends keyof Questions>(
    name: Name,
    asked: Questions[Name][0],
    transfer: Transferable[] = [],
  ): Promise<Questions[Name][1]> {
    if (this.#isClosed) return Promise.reject(new WorkerGone());
    if (this.#desk) return this.#desk.answer(name, asked);
    const id = ++this.#lastId;
    const asking = { id, name, asked } as Question;
    this.#worker!.postMessage(asking, transfer);
    const question = transfer.length > 0 ? undefined : asking;
    return new Promise((done, failed) => this.#waiting.set(id, { question, done: done as Waiting["done"], failed }));
  }

  close(): void {
    this.#isClosed = true;
    this.#worker?.terminate();
    for (const { failed } of this.#waiting.values()) failed(new WorkerGone());
    this.#waiting.clear();
  }

  #workerEnded(): void {
    if (!this.#mesh) return this.close();
    this.#worker?.terminate();
    this.#worker = undefined;
    const desk = (this.#desk = new Desk(this.#mesh));
    for (const { question, done, failed } of this.#waiting.values()) {
      if (question) desk.answer(question.name, question.asked).then(done, failed);
      else failed(new WorkerGone());
    }
    this.#waiting.clear();
  }

  #take(data: Answer): void {
    const waiting = this.#waiting.get(data.id);
    this.#waiting.delete(data.id);
    if ("answer" in data) return waiting?.done(data.answer);
    if ("fault" in data) return waiting?.failed(new FileFault(data.fault));
    const { code, message, ...details } = data.error;
    waiting?.failed(new LpdeformError(code, message, details));
  }
}
