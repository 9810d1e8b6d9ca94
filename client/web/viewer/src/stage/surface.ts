import * as three from "three";
import type { Mesh } from "../model/mesh.js";
import { Pairs } from "../model/pairs.js";
import type { ColourBy } from "../model/view.js";
import { DrawMesh } from "./drawmesh.js";
import { isSoftware } from "./software.js";
import { colourByNormal, surfaceMaterial } from "./surface_material.js";

/** The value for each colour. */
export interface Scale {
  low: number;
  red: number;
  isLogarithmic: boolean;
}

/** With this many vertices, lighting per vertex looks like lighting per pixel. */
const denseVertices = 4000;

/** The surface of a pane: faces, wireframe, the original as a ghost. */
export class Surface {
  readonly group = new three.Group();
  /** The positions of the mesh's vertices, as drawn. */
  positions: Float32Array;
  readonly #draw: DrawMesh;
  readonly #geometry = new three.BufferGeometry();
  readonly #values: Float32Array;
  readonly #isPerVertex: boolean;
  readonly #material: three.ShaderMaterial;
  readonly #wire = new three.LineSegments(
    new three.BufferGeometry(),
    new three.LineBasicMaterial({ transparent: true, opacity: 0.35 }),
  );
  readonly #ghost: three.Mesh;

  constructor(
    readonly mesh: Mesh,
    faces = mesh.faces,
  ) {
    this.positions = mesh.positions;
    this.#draw = new DrawMesh({ ...mesh, faces });
    this.#values = new Float32Array(this.#draw.source.length);
    this.#isPerVertex = isSoftware && mesh.positions.length > 3 * denseVertices;
    this.#material = surfaceMaterial(this.#isPerVertex, this.#draw.isClosed);
    const geometry = this.#geometry;
    geometry.setIndex(new three.BufferAttribute(this.#draw.indices, 1));
    geometry.setAttribute("position", live(this.#draw.positions, 3));
    geometry.setAttribute("normal", live(this.#draw.normals, 3));
    geometry.setAttribute("value", live(this.#values, 1));
    this.#ghost = this.#makeGhost();
    const drawn = new three.Mesh(geometry, this.#material);
    for (const object of [drawn, this.#wire, this.#ghost]) {
      object.frustumCulled = false;
      this.group.add(object);
    }
    this.#wire.visible = this.#ghost.visible = false;
  }

  /** Positions of the mesh's vertices; the array is kept. */
  move(positions: Float32Array): void {
    this.positions = positions;
    this.#draw.take(positions);
    this.#geometry.attributes["position"]!.needsUpdate = true;
    this.#geometry.attributes["normal"]!.needsUpdate = true;
  }

  colour(by: ColourBy, values: Float32Array | undefined, { low, red, isLogarithmic }: Scale): void {
    if (values) {
      this.#draw.spread(values, this.#values);
      this.#geometry.attributes["value"]!.needsUpdate = true;
    }
    const uniforms = this.#material.uniforms;
    uniforms["low"]!.value = low;
    uniforms["red"]!.value = red;
    uniforms["logarithmic"]!.value = isLogarithmic ? 1 : 0;
    uniforms["colourful"]!.value = values && by !== "plain" && by !== "normals" ? 1 : 0;
    colourByNormal(this.#material, by === "normals", this.#isPerVertex);
  }

  show({ wireframe, ghost, isDark }: { wireframe: boolean; ghost: boolean; isDark: boolean }): void {
    if (wireframe) this.#findEdges();
    this.#wire.visible = wireframe;
    this.#ghost.visible = ghost;
    (this.#wire.material as three.LineBasicMaterial).color.set(isDark ? "#05070c" : "#1b2436");
    (this.#ghost.material as three.MeshBasicMaterial).color.set(isDark ? "#b9c6dc" : "#4f5d75");
  }

  dispose(): void {
    this.#geometry.dispose();
    this.#wire.geometry.dispose();
    this.#ghost.geometry.dispose();
    for (const { material } of [this.#wire, this.#ghost]) (material as three.Material).dispose();
    this.#material.dispose();
  }

  /** Once, when they are first needed, because it takes some time for large meshes. */
  #findEdges(): void {
    const { geometry } = this.#wire;
    if (geometry.index) return;
    const { indices, source } = this.#draw;
    const lines = new Uint32Array(2 * indices.length);
    const known = new Pairs(indices.length);
    for (let corner = 0; corner < indices.length; ++corner) {
      const next = corner % 3 === 2 ? corner - 2 : corner + 1;
      const [a, b] = [source[indices[corner]!]!, source[indices[next]!]!];
      const end = 2 * known.size;
      if (!known.set(Math.min(a, b), Math.max(a, b), corner)) continue;
      lines[end] = indices[corner]!;
      lines[end + 1] = indices[next]!;
    }
    geometry.setIndex(new three.BufferAttribute(lines.slice(0, 2 * known.size), 1));
    geometry.setAttribute("position", this.#geometry.attributes["position"]!);
  }

  #makeGhost(): three.Mesh {
    const geometry = new three.BufferGeometry();
    geometry.setIndex(new three.BufferAttribute(this.mesh.faces, 1));
    geometry.setAttribute("position", new three.BufferAttribute(this.mesh.positions, 3));
    const material = new three.MeshBasicMaterial({
      transparent: true,
      opacity: 0.13,
      depthWrite: false,
      side: three.DoubleSide,
    });
    const ghost = new three.Mesh(geometry, material);
    ghost.renderOrder = 2;
    return ghost;
  }
}

function live(array: Float32Array, itemSize: number): three.BufferAttribute {
  return new three.BufferAttribute(array, itemSize).setUsage(three.DynamicDrawUsage);
}
