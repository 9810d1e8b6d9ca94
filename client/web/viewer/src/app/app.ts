import type { MeshReport } from "lpdeform-client";
import { type Adjacency, adjacencyOf } from "lpdeform-client/mesh/adjacency";
import { type AxisView, directionOf, viewAfter } from "../model/axis_views.js";
import { derivedOf, isKnown, usualWelding, type Welding } from "lpdeform-client/mesh/derived";
import { type Document, emptyDocument, type Handle, handleOf } from "../model/document.js";
import type { Shape } from "../model/blend.js";
import { isAlike } from "../model/alike.js";
import { History, type Steps } from "../model/history.js";
import { keyPoseOf } from "../model/key_poses.js";
import { kindOf } from "../model/hold_kinds.js";
import { leastEdge } from "../model/least_edge.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { Mirror, mirrorAxes, type Symmetry } from "../model/mirror.js";
import { type Detail, shapeKinds } from "../model/shapes.js";
import type { Seams } from "lpdeform-client/mesh/seams";
import { nothing } from "../model/pointed.js";
import { subtract } from "../model/pose.js";
import { gridStep } from "../model/snap.js";
import { State } from "../model/state.js";
import { short } from "../model/words.js";
import { symmetric } from "../model/symmetric.js";
import { firstView, type View } from "../model/view.js";
import type { Look, Stage } from "../stage/stage.js";
import { keepOnly, prepare } from "../io/opened.js";
import { sentence } from "../link/status.js";
import { watchedMesh } from "../link/watched.js";
import { Asides, type Kept, weldingOf } from "./asides.js";
import { type Facts, firstFacts, noMesh } from "./facts.js";
import { Pace } from "./pace.js";
import { Editing } from "./editing.js";
import type { Pane } from "./pane.js";
import { Panes } from "./panes.js";
import { panelIs } from "./sides.js";
import type { Workbench } from "./workbench.js";

/** The page's central object: the work, the view, the panes, and the loop that draws them. */
export class App implements Workbench {
  readonly view = new State<View>(firstView);
  readonly facts = new State<Facts>(firstFacts);
  readonly history = new History<Document>(emptyDocument, isAlike);
  adjacency: Adjacency = adjacencyOf(0, noMesh.faces);
  diagonal = 1;
  edge = 0;
  /** Called after each picture that was drawn. */
  readonly afterDrawing = new Set<(now: number) => void>();
  /** Each ends something that is under way outside the history; true if there was something. */
  readonly onCancel = new Set<() => boolean>();
  #seams: Seams | undefined;
  #watched: string | undefined;
  #wishedWelding: Welding | undefined;
  #welded = Promise.resolve();
  #openings = 0;
  #mirror: { of: readonly unknown[]; mirror: Mirror } | undefined;
  readonly #asides = new Asides();
  #isBroughtBack = false;
  #isKeyHeld = false;
  /** The handles that were selected when the first of them went. */
  #deselected: readonly string[] = [];
  #asked = 0;
  readonly #pace = new Pace(() => this.requestDraw());
  readonly #editings = new Set<Editing>();
  readonly #panes = new Panes(
    {
      changed: () => this.requestDraw(),
      resized: () => this.#panes.isAsFitted && this.fit(),
      status: () => this.#statusChanged(),
      report: (report) => this.#showReport(report),
      problem: (problem) => this.facts.set({ problem }),
      notice: (text) => this.notify(text),
      better: () => this.#showBetter(),
      dressed: () => {
        this.#needsColours = true;
        this.requestDraw();
      },
    },
    (pane) => this.#edit(pane),
  );
  #needsColours = true;
  #needsMarks = true;
  #isToFit = false;
  /** Poses play: the document is between two of them, and the user has not made it so. */
  isPlaying = false;

  constructor(readonly isWatching = false) {
    this.#panes.add("first");
    this.view.watchAll((view, before) => this.#viewChanged(view, before));
    this.facts.watch(
      ({ pointedOut }) => [pointedOut],
      () => {
        this.#needsMarks = true;
        this.requestDraw();
      },
    );
    // Nobody waits for the end of an idle session. A page that the browser sets aside goes on when it comes back.
    window.addEventListener("pagehide", ({ persisted }) => {
      if (!persisted) for (const { live } of this.panes) live?.close(true);
    });
    for (const end of ["keyup", "blur"]) window.addEventListener(end, () => this.#keyUp());
  }

  #edit(pane: Pane): void {
    const editing = new Editing(this, pane);
    this.#editings.add(editing);
    pane.over.signal.addEventListener("abort", () => {
      editing.release();
      this.#editings.delete(editing);
    });
  }

  /** Both panes have the same report. */
  #showReport(report: MeshReport): void {
    const isKnown = this.facts.now.report !== undefined;
    this.facts.set({ report });
    if (!isKnown) for (const notice of report.notices) this.notify(notice, true);
  }

  get panes(): readonly Pane[] {
    return this.#panes.all;
  }

  /** The element that holds the panes. */
  get stages(): HTMLElement {
    return this.#panes.element;
  }

  get document(): Document {
    return this.history.present;
  }

  get mesh(): Mesh {
    return this.facts.now.mesh;
  }

  // The work.

  openShape(id: string, detail: Detail): void {
    this.opening();
    this.#openShape(id, detail, this.document);
  }

  #openShape(id: string, detail: Detail, { p, secondP }: Document): void {
    const kind = shapeKinds.find((shape) => shape.id === id) ?? shapeKinds[0]!;
    const { mesh, document, first } = kind.make(detail);
    this.open(mesh, { ...document, p, secondP });
    this.view.set({ shape: kind.id, detail, selected: first, tool: "move", isYUp: false, pinned: undefined });
  }

  /** Starts without anything of the previous work. */
  startOver(id: string, detail: Detail): void {
    const { isTouched } = this;
    this.#openShape(id, detail, emptyDocument);
    if (isTouched) this.#asides.release();
  }

  /** Whether anything was changed since the work was opened. */
  get isTouched(): boolean {
    return this.#isBroughtBack || this.history.canUndo || this.history.canRedo;
  }

  /** Which vertices count as one, if any do. */
  get seams(): Seams | undefined {
    return this.view.now.isWelded ? this.#seams : undefined;
  }

  /** Sets which vertices along seams move as one. Of several wishes the last one counts. If it fails, the user is told. */
  weld(welding: Welding): Promise<void> {
    const { mesh, diagonal } = this;
    const share = leastEdge(mesh) / diagonal;
    if (welding.isOn && welding.tolerance > usualWelding.tolerance && welding.tolerance >= share) {
      this.notify(`The shortest edge has ${short(100 * share)} % of the size: its ends would be one vertex.`, true);
      return Promise.resolve();
    }
    this.#wishedWelding = welding;
    // One after the other: what was found last is what derivedOf() has.
    return (this.#welded = this.#welded.then(() => this.#weld(mesh, welding)));
  }

  async #weld(mesh: Mesh, welding: Welding): Promise<void> {
    const isWanted = () => this.mesh === mesh && this.#wishedWelding === welding;
    if (!isWanted()) return;
    try {
      await prepare(mesh, welding);
    } catch (thrown) {
      return this.notify(`The welding stays as it is. ${sentence((thrown as Error).message)}`, true);
    }
    if (!isWanted() || !isKnown(mesh, welding)) return;
    this.#takeWelding();
    this.facts.set({ report: undefined, problem: undefined });
    this.#openPanes();
  }

  #takeWelding(): void {
    const { seams, looseCount, welding } = derivedOf(this.mesh);
    this.#seams = seams;
    this.view.set({ isWelded: welding.isOn, weldTolerance: welding.tolerance });
    this.facts.set({ seamVertices: seams?.copyCount ?? 0, looseVertices: looseCount });
  }

  #openPanes(): void {
    const { mesh } = this;
    this.adjacency = derivedOf(mesh).shown.adjacency;
    for (const pane of this.panes) pane.open(mesh, this.document, this.view.now, this.#watched);
    this.#needsMarks = true;
    this.#documentChanged(performance.now());
  }

  /** The user begins to open something. The returned function says whether it is still what the user wanted last. */
  opening(): () => boolean {
    const own = ++this.#openings;
    return () => own === this.#openings;
  }

  /** `isBroughtBack`: the user has worked on it before. */
  open(mesh: Mesh, document: Document, isBroughtBack = false): void {
    this.endAll();
    if (this.isTouched) this.#asides.put(this.#present());
    this.#isBroughtBack = isBroughtBack;
    this.history.reset(document);
    keepOnly(mesh);
    const { edge, bounds } = derivedOf(mesh);
    this.edge = edge;
    this.diagonal = bounds.diagonal;
    this.view.set({ selected: undefined, shape: "", pinned: undefined });
    this.facts.set({
      mesh,
      report: undefined,
      problem: undefined,
      restoredFrom: undefined,
      notice: undefined,
      pointedOut: nothing,
      setAside: this.#asides.names,
    });
    this.#takeWelding();
    if (this.view.now.colourBy === "texture" && !this.isTextured) this.view.set({ colourBy: "distortion" });
    this.#openPanes();
    this.#fitSoon();
  }

  /**
   * Shows somebody else's session, for as long as the page is there; only if `isWatching`. Waits for a server that is away. Rejects
   * with an LpdeformError if it cannot be watched.
   */
  async watch(session: string): Promise<void> {
    const mesh = await watchedMesh(session, (status) => this.facts.set({ status }));
    await prepare(mesh, usualWelding);
    this.#watched = session;
    this.open(mesh, emptyDocument);
    this.view.set({ isYUp: derivedOf(mesh).isYUp });
  }

  #present(): Kept {
    const { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance } = this.view.now;
    const { look } = this;
    const view = { shape, detail, selected, isYUp, pinned, isWelded, weldTolerance };
    return { mesh: this.mesh, document: this.document, view, look, steps: this.history.stepsSoFar };
  }

  /**
   * What the user would miss, first what a reload must show: the present work if it was changed or its mesh is from a file, and
   * work that was set aside.
   */
  get worthKeeping(): readonly Kept[] {
    const { wanted } = this.#asides;
    const isMissed = this.isTouched || this.view.now.shape === "";
    return isMissed ? [this.#present(), ...wanted] : wanted;
  }

  /** Adds works that were kept over a reload, the newest first. */
  setAside(works: readonly Kept[]): void {
    for (const work of works.toReversed()) this.#asides.put(work);
    this.#tellAsides();
  }

  dismissAside(id: number): void {
    this.#asides.take(id);
    this.#tellAsides();
  }

  /** Restores work that was set aside, with its history. The present work is set aside instead. */
  async bringBack(id: number): Promise<void> {
    const wanted = this.#asides.find(id);
    const isNewest = this.opening();
    if (wanted) await prepare(wanted.mesh, weldingOf(wanted.view));
    if (!isNewest()) return;
    const aside = this.#asides.take(id);
    if (!aside) return;
    this.open(aside.mesh, aside.document, true);
    this.#restoreSteps(aside.steps);
    this.view.set({ ...aside.view, tool: "move" });
    this.lookFrom(aside.look);
  }

  /** Opens work that was kept over a reload, or in a file. */
  async restore({ mesh, document, view, look, steps }: Kept): Promise<void> {
    await prepare(mesh, weldingOf(view));
    this.open(mesh, document, true);
    this.#restoreSteps(steps);
    this.view.set(view);
    this.lookFrom(look);
  }

  /** Those of the present document. */
  #restoreSteps(steps: Steps<Document> | undefined): void {
    if (!steps) return;
    this.history.restore({ ...steps, present: this.document });
    this.#documentChanged(performance.now());
  }

  #tellAsides(): void {
    this.facts.set({ setAside: this.#asides.names });
  }

  change(document: Document, isWhole = false): void {
    this.history.push(isWhole ? document : this.#symmetric(document));
    this.#documentChanged(performance.now());
  }

  during(document: Document, time: number, isWhole = false): void {
    this.history.during(isWhole ? document : this.#symmetric(document));
    this.#documentChanged(time);
  }

  /** Whether the file of the mesh has materials that are shown. */
  get isTextured(): boolean {
    const { gltf, materials, beside } = this.mesh;
    return materials !== undefined || (gltf !== undefined && beside?.includes("materials") === true);
  }

  get mirror(): Mirror | undefined {
    const { symmetry } = this.view.now;
    if (symmetry === "none" || this.mesh === noMesh) return undefined;
    const { mesh, adjacency, edge } = this;
    const of = [mesh, adjacency, symmetry] as const;
    if (!this.#mirror?.of.every((one, k) => one === of[k])) {
      const { bounds } = derivedOf(mesh);
      this.#mirror = { of, mirror: new Mirror(mesh, bounds, mirrorAxes[symmetry], edge || this.diagonal, adjacency) };
    }
    return this.#mirror.mirror;
  }

  /** Leading are the handles that are selected. */
  #symmetric(document: Document): Document {
    const { mirror } = this;
    const { selected, alsoSelected } = this.view.now;
    return mirror ? symmetric(this.document, document, mirror, [selected ?? "", ...alsoSelected]) : document;
  }

  /** What is not symmetric yet stays as it is until it is worked on. */
  setSymmetry(symmetry: Symmetry): void {
    this.view.set({ symmetry });
    if (symmetry === "none") return;
    this.notify(`What is done on one side of the plane across ${symmetry} is done on the other.`);
  }

  endGesture(): void {
    this.history.end();
    this.#documentChanged(performance.now());
  }

  /** Like during(), by a key: the gesture lasts until the key is released, however often it repeats. */
  byKey(document: Document, { timeStamp }: KeyboardEvent): void {
    this.#isKeyHeld = true;
    this.during(document, timeStamp);
  }

  #keyUp(): void {
    if (!this.#isKeyHeld) return;
    this.#isKeyHeld = false;
    this.endGesture();
  }

  /** Reverts what the present gesture has changed, by pointer, slider or key, without a step. False if there is no gesture. */
  cancelGesture(): boolean {
    this.#isKeyHeld = false;
    if (!this.history.cancel()) return false;
    this.#documentChanged(performance.now());
    return true;
  }

  /** Like cancelGesture(), and also ends drags by the pointer in every picture. */
  cancelAll(): boolean {
    const held = [...this.#editings].map((editing) => editing.cancel());
    const others = [...this.onCancel].map((cancel) => cancel());
    return this.cancelGesture() || [...held, ...others].includes(true);
  }

  /** Writes what the pointer has done so far into the document. Call it before the document is saved. */
  flush(): void {
    for (const editing of this.#editings) editing.flush();
  }

  /** Ends drags by the pointer in every picture: what they have moved becomes a step. */
  endAll(): void {
    for (const editing of this.#editings) editing.release();
  }

  /** What the pointer has done so far is the first step to go. A handle that comes back is selected again if it was when it went. */
  undo(): void {
    this.endAll();
    const { handles } = this.document;
    if (!this.history.undo()) return;
    this.#documentChanged(performance.now());
    if (this.view.now.selected !== undefined) return;
    const back = this.document.handles.filter(({ name }) => !handles.some((one) => one.name === name));
    const names = back.map(({ name }) => name);
    const selected = this.#deselected.filter((name) => names.includes(name));
    const [first, ...alsoSelected] = selected.length > 0 || names.length > 1 ? selected : names;
    if (first !== undefined) this.view.set({ selected: first, alsoSelected });
  }

  redo(): void {
    this.endAll();
    if (this.history.redo()) this.#documentChanged(performance.now());
  }

  notify(text: string, isBad = false): void {
    this.facts.set({ notice: { text, isBad } });
  }

  /** Whether the handle can be dragged to another place; if not, tells the user why. */
  canShift({ name, isLocked, hold }: Handle): boolean {
    if (isLocked) this.notify(`“${name}” is locked: its padlock in the list lets it move.`);
    else if (kindOf(hold).isTurnedOnly) {
      this.notify(`“${name}” is held by its direction alone: turn it by its rings or with arrow keys.`);
      this.view.set({ gizmo: "rotate" });
    } else return true;
    return false;
  }

  #showBetter(): void {
    const better = this.panes.map(({ live }) => live?.better?.savedShare).filter((share) => share !== undefined);
    if (!isAlike(better, this.facts.now.better)) this.facts.set({ better });
  }

  /** After a failure at which the page has stopped trying. */
  tryAgain(): void {
    for (const { live } of this.panes) live?.tryAgain();
  }

  /** In every pane. */
  takeBetter(): void {
    for (const { live } of this.panes) void live?.takeBetter();
  }

  /** Shows a line that stays until the returned function is called, or until another line comes. */
  notifyWhile(text: string): () => void {
    const notice = { text, isBad: false, stays: true };
    this.facts.set({ notice });
    return () => {
      if (this.facts.now.notice === notice) this.facts.set({ notice: undefined });
    };
  }

  fit(): void {
    this.#isToFit = false;
    this.#panes.fit(this.view.now.isYUp);
  }

  /** In a task of its own, because the page has to be laid out for it; but before somebody asks for the look. */
  #fitSoon(): void {
    this.#isToFit = true;
    setTimeout(() => this.fitIfWanted());
  }

  /** If a new mesh is still to be fitted into the pictures. */
  fitIfWanted(): void {
    if (this.#isToFit) this.fit();
  }

  /** From where the first picture is seen. */
  get look(): Look {
    this.fitIfWanted();
    return this.panes[0]!.stage.look;
  }

  /** Turns the view to some vertices of the mesh. */
  lookAt(vertices: readonly number[]): void {
    this.fitIfWanted();
    for (const pane of this.panes) pane.lookAt(vertices);
  }

  /** Changes the view by keys, in the picture with the focus or else the first; the other one follows. */
  changeView(change: (stage: Stage) => void): void {
    this.fitIfWanted();
    this.#panes.changeView(change);
  }

  lookAlong(view: AxisView): void {
    const { isYUp } = this.view.now;
    this.changeView((stage) => stage.lookAlong(directionOf(view, isYUp), directionOf("front", isYUp)));
  }

  /** The view along the next of the mesh's axes. */
  lookAlongNext(): void {
    const { position, target } = this.look;
    this.lookAlong(viewAfter(subtract(position, target), this.view.now.isYUp));
  }

  lookFrom(look: Look): void {
    this.fitIfWanted();
    this.#panes.lookFrom(look);
  }

  /** Adds the present pose to those that are kept. */
  keepPose(): void {
    const { document } = this;
    const pose = keyPoseOf(document);
    this.change({ ...document, keyPoses: [...(document.keyPoses ?? []), pose] });
    this.notify(`“${pose.name}” is kept.`);
  }

  // The panes.

  /** Shows a shape in the first picture in place of the server's frames, until endPreview(). `p`: of the shape, if controls show it. */
  preview(shape: Shape, p?: number): void {
    this.panes[0]!.preview(shape);
    this.#sayPreview(p);
    this.#needsColours = true;
    this.requestDraw();
  }

  #sayPreview(previewP: number | undefined): void {
    this.facts.set({ previewP });
    this.#panes.label(this.document, previewP);
  }

  endPreview(withNextFrame: boolean): void {
    this.panes[0]!.endPreview(withNextFrame);
    this.#sayPreview(undefined);
    this.#needsColours = true;
    this.requestDraw();
  }

  /** The distortion in full red, the same in both panes so that they can be compared. */
  get red(): number {
    return this.view.now.pinned ?? (this.isDistorted ? this.#red : 0);
  }

  /** Whether the distortion is more than rounding at rest. */
  get isDistorted(): boolean {
    return this.#red > 1e-8 * this.diagonal;
  }

  get #red(): number {
    return Math.max(...this.panes.map(({ statistics }) => statistics.red));
  }

  togglePin(): void {
    this.view.set({ pinned: this.view.now.pinned === undefined && this.red > 0 ? this.red : undefined });
  }

  requestDraw(): void {
    this.#asked ||= requestAnimationFrame((now) => this.#draw(now));
  }

  #draw(now: number): void {
    this.#asked = 0;
    this.fitIfWanted();
    let isNew = false;
    for (const pane of this.panes) {
      pane.shown(now);
      isNew = pane.takeFrame() || isNew;
    }
    if (isNew || this.#needsColours) for (const pane of this.panes) pane.colour(this.document, this.view.now, this.red);
    if (isNew || this.#needsColours) for (const editing of this.#editings) editing.refresh();
    this.#needsColours = false;
    if (this.#needsMarks) this.#mark();
    const { document, problem } = this.facts.now;
    for (const pane of this.panes) pane.lookAhead(document, problem === undefined);
    const isAtRest = !this.#isMoving && this.#pace.isAtRest(now);
    const drawn = this.panes.map((pane) => pane.draw(isAtRest, this.#pace.quality));
    if (drawn.includes(true)) this.#pace.drew(now);
    for (const after of this.afterDrawing) after(now);
    if (this.panes.some((pane) => pane.isWaitingForScreen)) this.requestDraw();
  }

  /** Whether a frame will come that moves the surface: a fine picture before it would only delay it. */
  get #isMoving(): boolean {
    const { status, problem, document } = this.facts.now;
    const isSolving = status.kind === "live" && problem === undefined && document.handles.length > 0;
    return isSolving && this.panes.some(({ live }) => live?.isSettling);
  }

  #mark(): void {
    this.#needsMarks = false;
    const { pointedOut, document } = this.facts.now;
    const { tool, isDark, selected, gizmo, axes, snapping } = this.view.now;
    const colour = tool === "paint" ? "#ffffff" : isDark ? "#ffe066" : "#d6006d";
    const handle = handleOf(document, selected);
    const pose = tool === "move" && handle && !handle.isLocked && !handle.targets ? handle.pose : undefined;
    const step = snapping === "grid" ? gridStep(this.diagonal) : undefined;
    for (const pane of this.panes) {
      pane.mark(document, this.view.now, pointedOut, colour);
      pane.stage.plane.show(this.mirror?.axis, derivedOf(this.mesh).bounds);
      pane.stage.gizmo.show(pose, handle && kindOf(handle.hold).isTurnedOnly ? "rotate" : gizmo, axes, step);
    }
  }

  /** Returns false, and tells the user, if the browser cannot draw a second picture. */
  #addSecondPane(): boolean {
    try {
      const pane = this.#panes.add("second");
      if (this.mesh !== noMesh) pane.open(this.mesh, this.document, this.view.now, this.#watched);
      return true;
    } catch {
      this.notify("This browser draws no second picture. Close other pages that draw in three dimensions.", true);
      this.view.set({ isSplit: false });
      return false;
    }
  }

  #statusChanged(): void {
    this.facts.set({ status: this.#panes.status });
  }

  #viewChanged(view: View, before: View): void {
    if (view.selected !== before.selected && view.alsoSelected === before.alsoSelected && view.alsoSelected.length > 0) {
      return this.view.set({ alsoSelected: [] }); // this is called again
    }
    panelIs(view.isPanelOpen);
    if (view.isSplit !== before.isSplit) {
      if (view.isSplit && !this.#addSecondPane()) return;
      if (!view.isSplit) this.#panes.removeSecond();
      queueMicrotask(() => this.fit()); // when the controls have what they show with two pictures
      this.#statusChanged();
      this.#documentChanged(performance.now());
      this.#needsMarks = true;
    }
    if (view.tool !== before.tool) queueMicrotask(() => this.#panes.needsFit && this.fit()); // when its options are there
    if (view.encoding !== before.encoding && this.mesh !== noMesh)
      for (const pane of this.panes) pane.open(this.mesh, this.document, view, this.#watched);
    if (view.search !== before.search) for (const { live } of this.panes) live?.lookFor(view.search);
    if (view.isYUp !== before.isYUp) this.#fitSoon();
    this.#needsColours = this.#needsMarks = true;
    this.requestDraw();
  }

  #documentChanged(time: number): void {
    const { document, history } = this;
    const { selected, alsoSelected } = this.view.now;
    const before = this.facts.now.document;
    if (document.handles !== before.handles) this.#needsMarks = true;
    if (document !== before) this.#needsColours = true;
    this.#panes.show(document, time);
    // The end of a gesture changes nothing, so the server's answer to its last change still holds.
    const problem = document === before ? this.facts.now.problem : undefined;
    this.facts.set({ document, canUndo: history.canUndo, canRedo: history.canRedo, problem });
    this.#showBetter();
    if (selected !== undefined && !handleOf(document, selected)) {
      this.#deselected = [selected, ...alsoSelected];
      this.view.set({ selected: undefined });
    }
    this.requestDraw();
  }
}
