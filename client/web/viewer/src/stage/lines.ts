import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

/** Lines of several pixels' width, which GPUs do not draw by themselves. */
export class Lines {
  readonly #material = new LineMaterial({ linewidth: 3.5, depthTest: false });
  readonly object = new LineSegments2(new LineSegmentsGeometry(), this.#material);

  /** `ends`: x, y, z of two points per line. */
  move(ends: Float32Array): void {
    this.object.geometry.dispose();
    this.object.geometry = new LineSegmentsGeometry().setPositions(ends);
  }

  colour(colour: string): void {
    this.#material.color.set(colour);
  }

  resize(width: number, height: number): void {
    this.#material.resolution.set(width, height);
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.#material.dispose();
  }
}
