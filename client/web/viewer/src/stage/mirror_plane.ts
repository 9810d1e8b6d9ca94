import * as three from "three";
import type { Bounds } from "lpdeform-client/mesh/mesh";
import type { MirrorAxis } from "../model/mirror.js";

/** How far its edges stand out from the mesh, as a share of the diagonal. */
const margin = 0.06;

/** The plane of symmetry: a pale pane of glass through the middle of a mesh. */
export class MirrorPlane {
  readonly object = new three.Group();
  readonly #material = new three.MeshBasicMaterial({
    color: "#7aa5ff",
    transparent: true,
    opacity: 0.13,
    depthWrite: false,
    side: three.DoubleSide,
  });
  readonly #edge = new three.LineBasicMaterial({ color: "#7aa5ff", transparent: true, opacity: 0.8 });

  constructor() {
    const square = new three.PlaneGeometry(1, 1);
    const glass = new three.Mesh(square, this.#material);
    glass.renderOrder = 3;
    this.object.add(glass, new three.LineSegments(new three.EdgesGeometry(square), this.#edge));
    this.object.visible = false;
  }

  /** Undefined: there is none. */
  show(axis: MirrorAxis | undefined, { min, max, center, diagonal }: Bounds): void {
    this.object.visible = axis !== undefined;
    if (axis === undefined) return;
    const size = min.map((low, k) => max[k]! - low + 2 * margin * diagonal) as [number, number, number];
    this.object.position.set(...center);
    this.object.rotation.set(axis === 1 ? Math.PI / 2 : 0, axis === 0 ? Math.PI / 2 : 0, 0);
    this.object.scale.set(axis === 0 ? size[2] : size[0], axis === 1 ? size[2] : size[1], 1);
  }

  dispose(): void {
    for (const object of this.object.children) (object as three.Mesh).geometry.dispose();
    this.#material.dispose();
    this.#edge.dispose();
  }
}
