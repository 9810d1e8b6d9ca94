import * as three from "three";
import { linesOf, type PointedOut, trianglesOf } from "../model/pointed.js";
import type { Lines } from "./lines.js";

/** Highlighted edges and faces. They are drawn through whatever is in front of them, so that they can be found. */
export class Highlight {
  readonly object = new three.Group();
  readonly #faceMaterial = new three.MeshBasicMaterial({
    transparent: true,
    opacity: 0.6,
    depthTest: false,
    side: three.DoubleSide,
  });
  /** Loaded with the first highlighted edge. */
  #lines: Lines | undefined;
  #loading: Promise<void> | undefined;
  readonly #faces = new three.Mesh(new three.BufferGeometry(), this.#faceMaterial);
  #ends: number[] = [];
  #corners: number[] = [];
  #colour = "#ffffff";
  #positions: Float32Array = new Float32Array(0);
  #size: [number, number] = [1, 1];

  /** `changed`: called when there is more to draw. */
  constructor(readonly changed: () => void) {
    this.#add(this.#faces);
    this.#faces.visible = false;
  }

  #add(object: three.Object3D): void {
    object.frustumCulled = false;
    object.renderOrder = 1;
    this.object.add(object);
  }

  /** If it fails, because the network or the server is away, edges are not highlighted until it succeeds. */
  async #load(): Promise<void> {
    try {
      const { Lines } = await import("./lines.js");
      this.#lines = new Lines();
      this.#add(this.#lines.object);
      this.#lines.resize(...this.#size);
      this.#showLines();
      this.changed();
    } catch {
      this.#loading = undefined;
    }
  }

  #showLines(): void {
    if (!this.#lines) return;
    this.#lines.object.visible = this.#ends.length > 0;
    this.#lines.colour(this.#colour);
    this.#moveLines();
  }

  #moveLines(): void {
    if (!this.#lines?.object.visible) return;
    const ends = new Float32Array(3 * this.#ends.length);
    this.#ends.forEach((vertex, k) => ends.set(this.#positions.subarray(3 * vertex, 3 * vertex + 3), 3 * k));
    this.#lines.move(ends);
  }

  show(pointed: PointedOut, meshFaces: Uint32Array, colour: string): void {
    const before = this.#ends.length + this.#corners.length;
    this.#ends = linesOf(pointed, meshFaces);
    this.#corners = trianglesOf(pointed, meshFaces);
    if (before + this.#ends.length + this.#corners.length === 0) return;
    this.#faces.visible = this.#corners.length > 0;
    this.#colour = colour;
    if (this.#ends.length > 0) this.#loading ??= this.#load();
    this.#showLines();
    this.#faceMaterial.color.set(colour);
    this.#faces.geometry.dispose();
    this.#faces.geometry = new three.BufferGeometry();
    this.#faces.geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(3 * this.#corners.length), 3));
  }

  /** Follows the surface. */
  move(positions: Float32Array): void {
    this.#positions = positions;
    this.#moveLines();
    if (!this.#faces.visible) return;
    const corners = this.#faces.geometry.attributes["position"] as three.BufferAttribute;
    this.#corners.forEach((vertex, k) =>
      (corners.array as Float32Array).set(positions.subarray(3 * vertex, 3 * vertex + 3), 3 * k),
    );
    corners.needsUpdate = true;
  }

  /** The size of the picture in CSS pixels, in which widths of lines are given. */
  resize(width: number, height: number): void {
    this.#size = [width, height];
    this.#lines?.resize(width, height);
  }

  dispose(): void {
    this.#lines?.dispose();
    this.#faces.geometry.dispose();
    this.#faceMaterial.dispose();
  }
}
