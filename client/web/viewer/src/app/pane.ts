import type { EnergyStatistics, Frame, LpdeformError, MeshReport, Shaded } from "lpdeform-client";
import { derivedOf, weldOf } from "lpdeform-client/mesh/derived";
import { Live, type LiveWatcher } from "../link/live.js";
import { say, type Status } from "../link/status.js";
import type { Shape } from "../model/blend.js";
import type { Side } from "../model/changes.js";
import { Matrix4 } from "three";
import { type Ahead, aheadOf } from "../model/ahead.js";
import { type Document, pField } from "../model/document.js";
import { boundsOf, centroid, type Mesh } from "lpdeform-client/mesh/mesh";
import type { Box } from "../model/free_room.js";
import { leastP, mostP } from "../model/exponent.js";
import { Progress } from "../model/progress.js";
import { pullOf } from "lpdeform-client/mesh/pull";
import { cornersOf, type PointedOut } from "../model/pointed.js";
import { energyStatistics } from "lpdeform-client/mesh/statistics";
import { gathered } from "../model/texturing.js";
import { selectionOf } from "../model/together.js";
import type { View } from "../model/view.js";
import { someOf } from "../model/words.js";
import { vertexNormals } from "lpdeform-client/mesh/normals";
import { type MeshWorker, workerOf } from "../io/opened.js";
import { Overlay } from "../stage/overlay.js";
import { Stage } from "../stage/stage.js";
import { motionBetween } from "../stage/ahead.js";
import type { Scale, Surface } from "../stage/surface.js";
import { EnergyTrail } from "./energy_trail.js";

export interface PaneWatcher {
  changed(): void;
  /** The picture has another size. */
  resized(): void;
  status(status: Status): void;
  report(report: MeshReport): void;
  problem(error: LpdeformError): void;
  notice(text: string): void;
  better(): void;
  /** There are textures to be shown. */
  dressed(): void;
}

/** A handle that is ahead of the frame, and how far vertices go along with it, once that is known. */
interface Pull {
  pulled: readonly number[];
  shares: Float32Array | undefined;
}

const nothing: EnergyStatistics = { max: 0, red: 0, top5Share: 0 };

/** One of the pictures side by side: a stage, and the session that supplies it. */
export class Pane {
  readonly element = document.createElement("div");
  readonly stage: Stage;
  readonly overlay = new Overlay();
  readonly trail = new EnergyTrail();
  readonly progress = new Progress();
  /** Aborts when the pane is closed. */
  readonly over = new AbortController();
  live: Live | undefined;
  frame: Frame | undefined;
  statistics = nothing;
  #isDirty = true;
  /** Of the element, in CSS pixels. */
  #size: [number, number] = [0, 0];
  #worker: MeshWorker | undefined;
  #onScreenNext: Frame | undefined;
  #pull: Pull | undefined;
  /** Shown in place of the frames. */
  #preview: Shape | undefined;
  #endsWithFrame = false;
  #dressed: Surface | undefined;
  #dressings = 0;

  constructor(
    readonly side: Side,
    readonly watcher: PaneWatcher,
  ) {
    this.element.className = "pane";
    this.stage = new Stage(() => {
      this.#isDirty = true;
      watcher.changed();
    });
    this.element.append(this.stage.canvas, this.overlay.element);
    const resized = new ResizeObserver(() => {
      this.#measure();
      watcher.resized();
      watcher.changed();
    });
    resized.observe(this.element);
    this.over.signal.addEventListener("abort", () => resized.disconnect());
  }

  /** `watched`: somebody else's session of the mesh. */
  open(mesh: Mesh, document: Document, view: View, watched?: string): void {
    this.live?.close();
    this.stage.open(mesh);
    this.#worker = workerOf(mesh);
    this.frame = this.#onScreenNext = this.#pull = this.#preview = undefined;
    this.statistics = nothing;
    this.trail.reset();
    this.progress.reset();
    const watcher: LiveWatcher = {
      frame: () => this.watcher.changed(),
      status: (status) => this.watcher.status(status),
      report: (report) => this.watcher.report(report),
      problem: (error) => this.watcher.problem(error),
      notice: (text) => this.watcher.notice(text),
      better: () => this.watcher.better(),
    };
    this.live = new Live(mesh, document, this.side, view.encoding, watcher, weldOf(derivedOf(mesh)), watched, this.#worker);
    this.live.lookFor(view.search);
    this.watcher.better();
    this.#isDirty = true;
  }

  get status(): Status {
    return this.live?.status ?? say("idle", "");
  }

  /** Undefined at rest, before the first frame. */
  get #distortion(): Float32Array | undefined {
    return (this.#preview ?? this.frame)?.distortion;
  }

  get distortion(): Float32Array {
    return this.#distortion ?? new Float32Array((this.stage.surface?.mesh.positions.length ?? 0) / 3);
  }

  /** Takes the newest frame if there is one. Returns true if the surface has changed. */
  takeFrame(): boolean {
    const frame = this.live?.take();
    if (!frame || !this.stage.surface) return false;
    const before = this.frame;
    if (frame.optimalityGap !== undefined && before?.inputSeq === frame.inputSeq && before.energy === frame.energy) {
      this.frame = frame; // the same frame again, with its certificate
      return false;
    }
    this.frame = this.#onScreenNext = frame;
    if (this.#endsWithFrame) this.#preview = undefined;
    if (!this.#preview) this.#move(frame.positions, frame.shaded);
    this.trail.add(frame.iteration, frame.energy ** (1 / this.live!.exponentOf(frame)));
    this.progress.add(frame);
    this.#isDirty = true;
    return true;
  }

  /**
   * Lets the surface follow the handles from the frame that is drawn to where they are in the document, until the next frame.
   * `mayMove`: whether the server takes the document.
   */
  lookAhead(document: Document, mayMove: boolean): void {
    const { surface } = this.stage;
    const of = this.frame && this.live?.answered;
    if (!surface || !of) return;
    const isFollowing = mayMove && !this.#preview && this.live?.status.kind === "live";
    const ahead = isFollowing ? aheadOf(of, document) : undefined;
    if (ahead && ahead.pulled !== this.#pull?.pulled) this.#findPull(surface, ahead);
    const motion = ahead && this.#pull?.shares ? motionBetween(ahead.from, ahead.to) : new Matrix4();
    if (motion.equals(surface.ahead.value)) return;
    surface.ahead.value.copy(motion);
    this.#isDirty = true;
  }

  #findPull(surface: Surface, { pulled, held }: Ahead): void {
    const pull: Pull = { pulled, shares: undefined };
    this.#pull = pull;
    this.#showPull(surface, undefined);
    const { positions } = surface.mesh;
    if (!this.#worker) return this.#showPull(surface, pullOf(positions, surface.adjacency, pulled, held));
    const show = (shares: Float32Array) => {
      if (this.#pull === pull && this.stage.surface === surface) this.#showPull(surface, shares);
    };
    this.#worker.pull({ pulled, held }).then(show, () => undefined); // the mesh was closed
  }

  #showPull(surface: Surface, shares: Float32Array | undefined): void {
    if (this.#pull) this.#pull.shares = shares;
    surface.pull(shares);
    this.stage.marks.pull(shares);
    this.watcher.changed();
  }

  /** Shows a shape in place of the frames, which go on being taken. */
  preview(shape: Shape): void {
    this.#preview = shape;
    this.#endsWithFrame = false;
    this.#move(shape.positions);
  }

  /** Shows frames again: from the next one on, or at once. */
  endPreview(withNextFrame: boolean): void {
    this.#endsWithFrame = withNextFrame;
    if (!this.#preview || withNextFrame) return;
    this.#preview = undefined;
    if (this.stage.surface) this.#move(this.frame?.positions ?? this.stage.surface.mesh.positions);
  }

  #move(positions: Float32Array, shaded?: Shaded): void {
    this.stage.surface!.move(positions, shaded);
    this.stage.marks.move(positions);
    this.stage.highlight.move(positions);
    this.statistics = shaded?.statistics ?? energyStatistics(this.distortion);
    this.#isDirty = true;
  }

  colour(document: Document, view: View, red: number): void {
    const { surface } = this.stage;
    if (!surface) return;
    if (view.colourBy === "texture") void this.#dress(surface);
    const p = this.side === "first" ? document.p : document.secondP;
    const count = surface.mesh.positions.length / 3;
    const [values, scale] = coloured(document, view, p, this.#distortion, red, count);
    surface.colour(view.colourBy, values, scale);
    surface.show(view);
    this.stage.darken(view.isDark);
    this.stage.drawParallel(view.isParallel);
    this.#isDirty = true;
  }

  /** Once, when its texture is first wanted. */
  async #dress(surface: Surface): Promise<void> {
    const { name, gltf, obj, materials } = surface.mesh;
    if (this.#dressed === surface || !(gltf || (obj && materials))) return;
    this.#dressed = surface;
    ++this.#dressings;
    try {
      const { closeAll, decoded, Textured } = await import("../stage/textured.js");
      const read = gltf
        ? (await import("../io/gltf_textures.js")).readGltfTextures(name, gltf)
        : await (await import("../io/obj_textures.js")).readObjTextures(obj!, materials!);
      const texturing = gathered(read);
      const images = await decoded(texturing.layers);
      if (this.stage.surface !== surface) return closeAll(images);
      const unknown = new Set(texturing.layers.map(({ image }, k) => (images[k] ? undefined : image)).filter(Boolean)).size;
      const few = unknown === 1 ? "One texture" : `${unknown} textures`;
      if (unknown > 0)
        this.watcher.notice(`${few} of ${name} cannot be shown: too large, or no image that this browser knows.`);
      const { missing = [] } = texturing;
      if (missing.length > 0) this.watcher.notice(`Open these images together with ${name} to see them: ${someOf(missing)}.`);
      surface.dress((indices, makeMaterial) => new Textured({ indices }, texturing, images, makeMaterial));
      this.watcher.dressed();
    } catch (thrown) {
      this.watcher.notice(`The textures of ${name} cannot be shown: ${(thrown as Error).message}`);
    } finally {
      --this.#dressings;
      this.watcher.changed();
    }
  }

  /** Whether images are being read for the surface. */
  get isDressing(): boolean {
    return this.#dressings > 0;
  }

  mark(document: Document, view: View, pointedOut: PointedOut, colour: string): void {
    const { surface, marks, pointed, highlight } = this.stage;
    if (!surface) return;
    const { positions, mesh } = surface;
    const selected = selectionOf(document, view).map(({ name }) => name);
    if (marks.show(document.handles, mesh.faces, selected)) {
      marks.move(positions);
      marks.pull(this.#pull?.shares);
    }
    pointed.show(cornersOf(pointedOut, mesh.faces), colour);
    highlight.show(pointedOut, mesh.faces, colour);
    highlight.move(positions);
    this.#isDirty = true;
  }

  fit(isYUp: boolean, covers: readonly Box[]): void {
    const { surface } = this.stage;
    if (!surface) return;
    this.#measure();
    this.#resize(true, 1);
    this.stage.fit(surface, isYUp, covers);
  }

  /** Near enough to see them, far enough to see where they are, and from outside. */
  lookAt(vertices: readonly number[]): void {
    const { surface } = this.stage;
    if (!surface || vertices.length === 0) return;
    const { positions, mesh } = surface;
    const normals = vertexNormals(positions, mesh.faces);
    const place = centroid(positions, vertices);
    const { diagonal } = boundsOf(positions, mesh.faces);
    const far = (vertex: number) => Math.hypot(...place.map((value, axis) => positions[3 * vertex + axis]! - value));
    const radius = vertices.reduce((most, vertex) => Math.max(most, far(vertex)), 0);
    this.stage.lookAt(place, centroid(normals, vertices), [Math.max(6 * radius, 1.6 * diagonal), 3 * diagonal]);
  }

  /** The browser lays the page out for it. */
  #measure(): void {
    const { clientWidth, clientHeight } = this.element;
    this.#size = [clientWidth, clientHeight];
  }

  #resize(isMoving: boolean, quality: number): void {
    const [width, height] = this.#size;
    if (this.stage.resize(width, height, isMoving, quality)) this.#isDirty = true;
  }

  /** Draws what has changed, or everything finely for a picture at rest. Returns true if anything was drawn. */
  draw(isAtRest: boolean, quality: number): boolean {
    if (isAtRest || this.#isDirty) this.#resize(!isAtRest, quality);
    else this.#resizeToPage();
    if (!this.#isDirty) return false;
    this.#isDirty = false;
    this.stage.draw();
    return !isAtRest;
  }

  /** If only the page's layout has changed. */
  #resizeToPage(): void {
    const [width, height] = this.#size;
    if (width !== this.stage.width || height !== this.stage.height) this.#resize(true, 1);
  }

  /**
   * Whether a frame was drawn that is not yet on the screen, as far as a page can know: it is there at the next animation
   * frame.
   */
  get isWaitingForScreen(): boolean {
    return this.#onScreenNext !== undefined;
  }

  shown(now: number): void {
    const frame = this.#onScreenNext;
    this.#onScreenNext = undefined;
    if (frame) this.live?.drawn(frame, now);
  }

  invalidate(): void {
    this.#isDirty = true;
  }

  close(): void {
    this.over.abort();
    this.live?.close();
    this.stage.dispose();
    this.element.remove();
  }
}

function coloured(
  document: Document,
  view: View,
  p: number,
  distortion: Float32Array | undefined,
  red: number,
  count: number,
): [Float32Array | 0 | undefined, Scale] {
  switch (view.colourBy) {
    case "distortion":
      return [distortion ?? 0, { low: 0, red, isLogarithmic: false }];
    case "p":
      return [pField(document, p) ?? new Float32Array(count).fill(p), { low: leastP, red: mostP, isLogarithmic: true }];
    case "stiffness":
      return [document.stiffness ?? new Float32Array(count).fill(1), { low: 0.01, red: 100, isLogarithmic: true }];
    default:
      return [undefined, { low: 0, red: 1, isLogarithmic: false }];
  }
}
