import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { derivedOf } from "lpdeform-client/mesh/derived";
import { boundsOf, type Mesh, type Vector3 } from "lpdeform-client/mesh/mesh";
import { type Box, freeRoom } from "../model/free_room.js";
import { Backdrop } from "./backdrop.js";
import { Highlight } from "./highlight.js";
import { LateGizmo } from "./late_gizmo.js";
import { Marks } from "./marks.js";
import { MirrorPlane } from "./mirror_plane.js";
import { PointedMarks } from "./pointed_marks.js";
import { isSoftware } from "./software.js";
import { Surface } from "./surface.js";

/** The camera's position and target. */
export interface Look {
  position: Vector3;
  target: Vector3;
}

/** A surface that nothing covers is at most so many times as far away as one that fills the picture. */
const mostFar = 2.5;

/** Height of a picture on which marks have their full size; on smaller pictures they would hide the surface. */
const fullSizeHeight = 700;

/** Of a picture at rest that the processor draws; more would take seconds. */
const mostPixels = 16e6;

/** One picture of a surface: canvas, camera, and what is drawn. It draws only when it is told to. */
export class Stage {
  readonly canvas = document.createElement("canvas");
  /** Where the user looks from. What is looked through is `camera`. */
  readonly #camera = new three.PerspectiveCamera(32, 1, 0.01, 1000);
  readonly #parallel = new three.OrthographicCamera();
  #isParallel = false;
  readonly marks = new Marks();
  readonly pointed = new PointedMarks();
  readonly plane = new MirrorPlane();
  readonly highlight: Highlight;
  readonly gizmo: LateGizmo;
  surface: Surface | undefined;
  readonly #backdrop = new Backdrop();
  readonly #renderer: three.WebGLRenderer;
  readonly #scene = new three.Scene();
  #controls: OrbitControls | undefined;
  /** Kept until the next picture, which draws by the same programs of the GPU: compiling them takes long. */
  readonly #replaced: Surface[] = [];
  #pixelRatio = 0;
  #size = [0, 0];
  /** How much of the picture counts as covered at each edge, in CSS pixels. */
  #covered: Box = { left: 0, top: 0, right: 0, bottom: 0 };

  constructor(readonly changed: () => void) {
    this.canvas.className = "stage";
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "application"); // keys are for the picture
    this.canvas.setAttribute("aria-roledescription", "picture to work in");
    this.#renderer = new three.WebGLRenderer({ canvas: this.canvas, antialias: !isSoftware, alpha: false });
    this.#renderer.debug.checkShaderErrors = import.meta.env.DEV; // the page would wait for the compiler
    this.canvas.addEventListener("webglcontextrestored", changed);
    this.#camera.up.set(0, 0, 1);
    this.highlight = new Highlight(changed);
    this.gizmo = new LateGizmo(this.#camera, this.canvas, changed, () => this.#restartControls());
    this.#scene.add(this.#backdrop.object, this.marks.object, this.pointed.object, this.highlight.object);
    this.#scene.add(this.plane.object, this.gizmo.object);
  }

  /** The camera that draws. It is read only: lookFrom() and the like change it. */
  get camera(): three.PerspectiveCamera | three.OrthographicCamera {
    return this.#isParallel ? this.#followed() : this.#camera;
  }

  /** Draws without perspective: what is at the target has the same size. */
  drawParallel(isParallel: boolean): void {
    if (isParallel === this.#isParallel) return;
    this.#isParallel = isParallel;
    this.gizmo.lookThrough(this.camera);
    this.changed();
  }

  #followed(): three.OrthographicCamera {
    const from = this.#camera;
    const to = this.#parallel;
    to.position.copy(from.position);
    to.quaternion.copy(from.quaternion);
    to.top = Math.tan((from.fov * Math.PI) / 360) * from.position.distanceTo(this.target);
    to.bottom = -to.top;
    to.right = to.top * from.aspect;
    to.left = -to.right;
    to.near = -from.far; // nothing is behind the viewer
    to.far = from.far;
    to.view = from.view;
    to.updateProjectionMatrix();
    to.updateMatrixWorld();
    return to;
  }

  /** From where surfaces are seen that face the viewer. */
  get eye(): Vector3 {
    const { position } = this.#camera;
    if (!this.#isParallel) return position.toArray();
    return position.clone().sub(this.target).multiplyScalar(1e5).add(position).toArray();
  }

  /** The line of sight at a place, in shares of the picture's width and height: from -1 to 1, to the right and up. */
  rayAt(x: number, y: number): three.Ray {
    const { camera } = this;
    const near = new three.Vector3(x, y, -1).unproject(camera);
    if (this.#isParallel) return new three.Ray(near, camera.getWorldDirection(new three.Vector3()));
    return new three.Ray(camera.position.clone(), near.sub(camera.position).normalize());
  }

  /** Called after all other listeners to the canvas are set: what they take does not turn the view. */
  startControls(): void {
    const controls = new OrbitControls(this.#camera, this.canvas);
    controls.rotateSpeed = 0.9;
    controls.zoomToCursor = true;
    controls.addEventListener("change", this.changed);
    this.gizmo.onDragging = (isDragging) => (controls.enabled = !isDragging);
    this.#controls = controls;
  }

  #restartControls(): void {
    if (!this.#controls) return;
    const { look } = this;
    this.#controls.dispose();
    this.startControls(); // it turns the camera to the origin
    this.lookFrom(look);
  }

  open(mesh: Mesh): void {
    const surface = new Surface(mesh); // made before the old one is removed, because there may be no memory for it
    if (this.surface) {
      this.surface.group.removeFromParent();
      this.#replaced.push(this.surface);
    }
    this.surface = surface;
    this.marks.attach(surface.ahead);
    this.pointed.attach(surface);
    this.#scene.add(surface.group);
  }

  get target(): three.Vector3 {
    return this.#controls?.target ?? new three.Vector3();
  }

  /** Shows everything, from the front and a little above. */
  fit({ positions, mesh }: Surface, isYUp: boolean, covers: readonly Box[]): void {
    const isAtRest = positions === mesh.positions;
    const { min, max, center, diagonal } = isAtRest ? derivedOf(mesh).bounds : boundsOf(positions, mesh.faces);
    const away = isYUp ? new three.Vector3(0.62, 0.42, 1) : new three.Vector3(0.62, -1, 0.42);
    const camera = this.#camera;
    camera.up.set(0, isYUp ? 1 : 0, isYUp ? 0 : 1);
    this.#restartControls(); // OrbitControls reads the camera's up when it is made
    camera.position.copy(away.normalize());
    camera.lookAt(0, 0, 0);
    this.target.set(...center);
    const distanceIn = (part: Box) => this.#distanceFor(min, max, center, part);
    const [right, bottom] = this.#size as [number, number];
    const whole = { left: 0, top: 0, right, bottom };
    // A part in the middle is better than one aside where the surface would be a little larger.
    const aside = ({ left, top, right: end, bottom: below }: Box) =>
      Math.hypot((left + end) / right - 1, (top + below) / bottom - 1);
    const room = freeRoom(whole, covers, (part) => -distanceIn(part) * (1 + aside(part)));
    const free = room.left < room.right ? room : whole;
    this.#covered = { left: free.left, top: free.top, right: right - free.right, bottom: bottom - free.bottom };
    this.#center();
    camera.position.copy(this.target).addScaledVector(away, Math.min(distanceIn(free), mostFar * distanceIn(whole)));
    camera.near = diagonal / 200;
    camera.far = diagonal * 100;
    camera.updateProjectionMatrix();
    this.#controls?.update();
    this.changed();
  }

  /**
   * The distance at which a box fits into the free part of the picture, seen from `place` in the camera's present direction.
   */
  #distanceFor(min: Vector3, max: Vector3, place: Vector3, free = this.#free): number {
    const camera = this.#camera;
    const height = Math.max(this.#size[1]!, 1);
    const tangent = Math.tan((camera.fov * Math.PI) / 360);
    const across = (tangent * Math.max(free.right - free.left - 40, 1)) / height;
    const up = (tangent * Math.max(free.bottom - free.top, 1)) / height;
    const turn = camera.quaternion.clone().invert();
    let far = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const at = place.map((from, axis) => ((corner >> axis) & 1 ? max : min)[axis]! - from) as [number, number, number];
      const seen = new three.Vector3(...at).applyQuaternion(turn);
      far = Math.max(far, seen.z + Math.abs(seen.x) / across, seen.z + Math.abs(seen.y) / up);
    }
    return 1.08 * far;
  }

  get look(): Look {
    return { position: this.#camera.position.toArray(), target: this.target.toArray() };
  }

  /** Call it after fit(). */
  lookFrom({ position, target }: Look): void {
    this.#camera.position.set(...position);
    this.target.set(...target);
    this.#camera.lookAt(this.target);
    this.#controls?.update();
    this.changed();
  }

  /**
   * Looks at the place from outside, along `normal`; from the present direction if that is undefined. The surface is in sight
   * with it, at a distance from `least` to `most`. If the surface is too far away for that, only the place is.
   */
  lookAt(place: Vector3, normal: Vector3, [least, most]: readonly [number, number]): void {
    const towards = new three.Vector3(...normal);
    if (towards.length() < 1e-6) towards.copy(this.#camera.position).sub(this.target);
    // Not from straight above or below, where left and right are unclear.
    const { up } = this.#camera;
    towards.normalize().addScaledVector(up, -0.2 * towards.dot(up));
    if (towards.clone().cross(up).length() < 0.1) towards.add(new three.Vector3(0.3, up.z ? -0.3 : 0, up.y ? 0.3 : 0));
    const { surface } = this;
    const camera = this.#camera;
    const { min, max, center } = boundsOf(surface!.positions, surface!.mesh.faces);
    const isOnIt = place.every((value, axis) => value >= min[axis]! && value <= max[axis]!);
    const middle = new three.Vector3(...place).lerp(new three.Vector3(...center), isOnIt ? 0.5 : 0);
    camera.position.copy(middle).add(towards.normalize());
    camera.lookAt(middle);
    const target = middle.toArray();
    const distance = Math.max(least, Math.min(this.#distanceFor(min, max, target), most));
    this.lookFrom({ position: middle.addScaledVector(towards, distance).toArray(), target });
  }

  /** Looks from this direction at the middle of the surface, all of which is in sight. `front`: what is below where up is unclear. */
  lookAlong(direction: Vector3, front: Vector3): void {
    const { surface } = this;
    const camera = this.#camera;
    if (!surface) return;
    const { min, max, center } = boundsOf(surface.positions, surface.mesh.faces);
    const away = new three.Vector3(...direction).addScaledVector(new three.Vector3(...front), 1e-4).normalize();
    camera.position.copy(away);
    camera.lookAt(0, 0, 0);
    const position = new three.Vector3(...center).addScaledVector(away, this.#distanceFor(min, max, center));
    this.lookFrom({ position: position.toArray(), target: center });
  }

  /** Turns like dragging the surface to the right and up by this many radians. */
  turn(right: number, up: number): void {
    const { target } = this;
    const camera = this.#camera;
    const toZ = new three.Quaternion().setFromUnitVectors(camera.up, new three.Vector3(0, 1, 0));
    const away = camera.position.clone().sub(target).applyQuaternion(toZ);
    const place = new three.Spherical().setFromVector3(away);
    place.theta -= right;
    place.phi += up;
    place.makeSafe();
    const position = away.setFromSpherical(place).applyQuaternion(toZ.invert()).add(target);
    this.lookFrom({ position: position.toArray(), target: target.toArray() });
  }

  /** Shifts the view by this many heights of the picture to the right and up. */
  shift(right: number, up: number): void {
    const { target } = this;
    const camera = this.#camera;
    const height = 2 * Math.tan((camera.fov * Math.PI) / 360) * camera.position.distanceTo(target);
    const by = new three.Vector3(right * height, up * height, 0).applyQuaternion(camera.quaternion);
    this.lookFrom({ position: camera.position.clone().add(by).toArray(), target: target.clone().add(by).toArray() });
  }

  /** Changes the distance by this factor. */
  approach(factor: number): void {
    const { target } = this;
    const camera = this.#camera;
    const position = target.clone().lerp(camera.position, factor);
    this.lookFrom({ position: position.toArray(), target: target.toArray() });
  }

  /** The same view as another stage. */
  lookAs(other: Stage): void {
    this.#camera.position.copy(other.#camera.position);
    this.#camera.quaternion.copy(other.#camera.quaternion);
    this.#camera.near = other.#camera.near;
    this.#camera.far = other.#camera.far;
    this.#camera.zoom = other.#camera.zoom;
    this.target.copy(other.target);
    this.#covered = other.#covered;
    this.#center();
  }

  /**
   * Sets the size on the page in CSS pixels. If drawing is slow, the picture is finer at rest than while it moves; `quality`,
   * up to 1, makes it coarser still. Returns true if the size has changed.
   */
  resize(width: number, height: number, isMoving: boolean, quality = 1): boolean {
    const fine = Math.min(2, Math.max(1, Math.sqrt(mostPixels / (width * height))));
    const ratio = isSoftware ? (isMoving ? quality : fine) : Math.min(devicePixelRatio, 2);
    if (ratio === this.#pixelRatio && width === this.#size[0] && height === this.#size[1]) return false;
    this.#pixelRatio = ratio;
    this.#size = [width, height];
    this.#renderer.setPixelRatio(ratio);
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / Math.max(height, 1);
    this.#center();
    const scale = ratio * Math.min(Math.max(height / fullSizeHeight, 0.6), 1);
    this.marks.scale(scale);
    this.pointed.scale(scale);
    this.highlight.resize(width, height);
    return true;
  }

  /** The middle of what is looked at is drawn in the middle of what is not covered. */
  #center(): void {
    const [width, height] = this.#size as [number, number];
    const { left, top, right, bottom } = this.#covered;
    this.#camera.setViewOffset(width, height, (right - left) / 2, (bottom - top) / 2, width, height);
  }

  get #free(): Box {
    const [width, height] = this.#size as [number, number];
    const { left, top, right, bottom } = this.#covered;
    return { left, top, right: width - right, bottom: height - bottom };
  }

  darken(isDark: boolean): void {
    this.#backdrop.darken(isDark);
  }

  draw(): void {
    this.gizmo.follow();
    if (this.surface?.send()) this.changed();
    this.#renderer.render(this.#scene, this.camera);
    for (const surface of this.#replaced.splice(0)) surface.dispose();
  }

  /** What is drawn, as fine as at rest, without the gizmo. */
  picture(): HTMLCanvasElement {
    this.resize(this.width, this.height, false);
    const wasVisible = this.gizmo.object.visible;
    this.gizmo.object.visible = false;
    while (this.surface?.send());
    this.draw();
    const copy = document.createElement("canvas");
    copy.width = this.canvas.width;
    copy.height = this.canvas.height;
    copy.getContext("2d")!.drawImage(this.canvas, 0, 0);
    this.gizmo.object.visible = wasVisible;
    this.changed();
    return copy;
  }

  get width(): number {
    return this.#size[0]!;
  }

  get height(): number {
    return this.#size[1]!;
  }

  dispose(): void {
    this.#controls?.dispose();
    this.gizmo.dispose();
    this.highlight.dispose();
    this.pointed.dispose();
    this.plane.dispose();
    for (const surface of [this.surface, ...this.#replaced]) surface?.dispose();
    this.#renderer.dispose();
    this.#renderer.forceContextLoss(); // browsers allow only a few, and remove the oldest
    this.canvas.remove();
  }
}
