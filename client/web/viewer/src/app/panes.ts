import { boundsOf } from "lpdeform-client/mesh/mesh";
import type { Document } from "../model/document.js";
import type { Box } from "../model/free_room.js";
import { project } from "../model/selection.js";
import { capital } from "../model/words.js";
import type { Status } from "../link/status.js";
import { viewProjection } from "../stage/pointing.js";
import type { Look, Stage } from "../stage/stage.js";
import { Pane, type PaneWatcher } from "./pane.js";
import { areOptionsOver, coversOf } from "./covers.js";
import { placeOf, watchPlaces } from "./sides.js";

/** What keys do in a picture, for screen readers. */
const keysText = document.createElement("p");
keysText.id = "picture-keys";
keysText.className = "unseen";
keysText.textContent =
  "Enter shows a cross: arrow keys move it, Enter places a handle there or selects the one that is there, Escape hides it. " +
  "Arrow keys and Page Up and Down move the selected handle, turn it if it has rings (R), or scale it if it has cubes (Z); without a " +
  "selection they turn the view. Control and arrow keys turn the view, with Shift they shift it; plus and minus zoom.";

/** The worst first. */
const worse: readonly Status["kind"][] = ["refused", "full", "draining", "away", "opening", "idle", "live"];

/** The pictures, one or two, which share their view. */
export class Panes {
  readonly element = document.createElement("div");
  readonly all: Pane[] = [];
  #turned: Pane | undefined;
  #fitted: Look | undefined;

  /** `added`: called when a pane is there, before its view can be changed. */
  constructor(
    readonly watcher: PaneWatcher,
    readonly added: (pane: Pane) => void,
  ) {
    this.element.className = "stages";
    this.element.append(keysText);
    watchPlaces(() => this.#nameAll());
  }

  /** Throws if the browser cannot draw another picture, because it allows only a few. */
  add(side: "first" | "second"): Pane {
    const pane: Pane = new Pane(side, {
      ...this.watcher,
      changed: () => {
        this.#follow(pane);
        this.watcher.changed();
      },
    });
    for (const turning of ["pointerdown", "wheel"]) {
      pane.element.addEventListener(turning, () => (this.#turned = pane), { capture: true, passive: true });
    }
    this.added(pane);
    pane.stage.startControls();
    this.all.push(pane);
    this.#split();
    return pane;
  }

  removeSecond(): void {
    if (this.all.length < 2) return;
    const second = this.all.pop()!;
    second.close();
    if (this.#turned === second) this.#turned = undefined;
    this.#split();
  }

  #split(): void {
    this.element.classList.toggle("split", this.all.length > 1);
    for (const { element } of this.all) if (!element.isConnected) this.element.append(element);
  }

  /** The worse status of the panes. */
  get status(): Status {
    const [worst] = this.all.map(({ status }) => status).sort((a, b) => worse.indexOf(a.kind) - worse.indexOf(b.kind));
    return worst!;
  }

  /** Changes the view by keys, in the picture with the focus or else the first; the other one follows. */
  changeView(change: (stage: Stage) => void): void {
    const pane = this.all.find(({ stage }) => stage.canvas === document.activeElement) ?? this.all[0]!;
    this.#turned = pane;
    change(pane.stage);
  }

  /** All from the same distance, at which the surface fits into each of them. */
  fit(isYUp: boolean): void {
    const covers = this.all.flatMap(({ element }) => coversOf(element)); // the same for all, so that they can be compared
    for (const pane of this.all) pane.fit(isYUp, covers);
    const far = ({ stage: { look } }: Pane) => Math.hypot(...look.position.map((value, axis) => value - look.target[axis]!));
    const farthest = this.all.reduce((most, pane) => (far(pane) > far(most) ? pane : most));
    for (const pane of this.all) if (pane !== farthest) pane.stage.lookAs(farthest.stage);
    this.#fitted = farthest.stage.look;
  }

  /** Whether the user has left the view as fit() had it. */
  get isAsFitted(): boolean {
    return this.#fitted !== undefined && isSameLook(this.#fitted, this.all[0]!.stage.look);
  }

  /** Whether the view is as fit() had it, but the options of another tool lie over the surface. */
  get needsFit(): boolean {
    return this.isAsFitted && this.all.some(({ element, stage }) => stage.surface && areOptionsOver(element, shownIn(stage)));
  }

  lookFrom(look: Look): void {
    for (const pane of this.all) pane.stage.lookFrom(look);
  }

  /** The other pane takes the view of the pane that is being turned. */
  #follow(pane: Pane): void {
    if (pane !== this.#turned) return;
    for (const other of this.all) {
      if (other === pane) continue;
      other.stage.lookAs(pane.stage);
      other.invalidate();
    }
  }

  /** `time`: of the input that led to this document. */
  show(work: Document, time: number): void {
    for (const { live } of this.all) live?.show(work, time);
    this.label(work);
  }

  /** `firstP`: of what the first picture shows in place of the server's frames. */
  label(work: Document, firstP = work.p): void {
    for (const pane of this.all) {
      const p = pane.side === "first" ? firstP : work.secondP;
      pane.element.dataset["label"] = pane.live?.watched
        ? "as it is shared"
        : work.isAutomatic
          ? "p from the shape"
          : `p = ${p}`;
    }
    this.#nameAll();
  }

  /** Names the pictures for screen readers. */
  #nameAll(): void {
    for (const { side, element, stage } of this.all) {
      const picture = this.all.length > 1 ? capital(`${placeOf(side)} picture`) : "Picture";
      const name = `${picture} of the surface, ${element.dataset["label"]}`;
      if (stage.canvas.ariaLabel === name) continue;
      stage.canvas.setAttribute("aria-label", name);
      stage.canvas.setAttribute("aria-describedby", keysText.id);
    }
  }
}

/** But for rounding: controls that are made again turn the camera to where it is. */
function isSameLook(a: Look, b: Look): boolean {
  const far = Math.hypot(...a.position.map((value, axis) => value - a.target[axis]!));
  const ends = [...a.position, ...a.target];
  return [...b.position, ...b.target].every((value, k) => Math.abs(value - ends[k]!) <= 1e-9 * far);
}

/** The part of the picture in which the surface is. */
function shownIn(stage: Stage): Box {
  const { positions, mesh } = stage.surface!;
  const { min, max } = boundsOf(positions, mesh.faces);
  const corners = Float32Array.from({ length: 24 }, (_, k) => ((Math.floor(k / 3) >> (k % 3)) & 1 ? max : min)[k % 3]!);
  const screen = [...project(corners, viewProjection(stage), stage.width, stage.height)];
  const [x, y] = [0, 1].map((axis) => screen.filter((_, k) => k % 2 === axis)) as [number[], number[]];
  return { left: Math.min(...x), top: Math.min(...y), right: Math.max(...x), bottom: Math.max(...y) };
}
