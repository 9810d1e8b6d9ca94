import * as three from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { linesOf, nothing, type PointedOut, trianglesOf } from "../model/pointed.js";

/** Highlighted edges and faces. They are drawn through whatever is in front of them, so that they can be found. */
export class Highlight {
  readonly object = new three.Group();
  readonly #lineMaterial = new LineMaterial({ linewidth: 3.5, depthTest: false });
  readonly #faceMaterial = new three.MeshBasicMaterial({
    transparent: true,
    opacity: 0.6,
    depthTest: false,
    side: three.DoubleSide,
  });
  readonly #lines = new LineSegments2(new LineSegmentsGeometry(), this.#lineMaterial);
  readonly #faces = new three.Mesh(new three.BufferGeometry(), this.#faceMaterial);
  #ends: number[] = [];
  #corners: number[] = [];

  constructor() {
    for (const object of [this.#faces, this.#lines]) {
      object.frustumCulled = false;
      object.renderOrder = 1;
      this.object.add(object);
    }
    this.show(nothing, new Uint32Array(0), "#ffffff");
  }

  show(pointed: PointedOut, meshFaces: Uint32Array, colour: string): void {
    this.#ends = linesOf(pointed, meshFaces);
    this.#corners = trianglesOf(pointed, meshFaces);
    this.#lines.visible = this.#ends.length > 0;
    this.#faces.visible = this.#corners.length > 0;
    this.#lineMaterial.color.set(colour);
    this.#faceMaterial.color.set(colour);
    this.#faces.geometry.dispose();
    this.#faces.geometry = new three.BufferGeometry();
    this.#faces.geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(3 * this.#corners.length), 3));
  }

  /** Follows the surface. */
  move(positions: Float32Array): void {
    const at = (vertex: number) => positions.subarray(3 * vertex, 3 * vertex + 3);
    if (this.#lines.visible) {
      const ends = new Float32Array(3 * this.#ends.length);
      this.#ends.forEach((vertex, k) => ends.set(at(vertex), 3 * k));
      this.#lines.geometry.dispose();
      this.#lines.geometry = new LineSegmentsGeometry().setPositions(ends);
    }
    const corners = this.#faces.geometry.attributes["position"] as three.BufferAttribute;
    this.#corners.forEach((vertex, k) => (corners.array as Float32Array).set(at(vertex), 3 * k));
    corners.needsUpdate = true;
  }

  /** The size of the picture in CSS pixels, in which widths of lines are given. */
  resize(width: number, height: number): void {
    this.#lineMaterial.resolution.set(width, height);
  }

  dispose(): void {
    this.#lines.geometry.dispose();
    this.#faces.geometry.dispose();
    this.#lineMaterial.dispose();
    this.#faceMaterial.dispose();
  }
}
