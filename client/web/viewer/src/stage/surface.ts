import * as three from "three";
import type { Adjacency } from "lpdeform-client/mesh/adjacency";
import { type Derived, derivedOf } from "lpdeform-client/mesh/derived";
import type { DrawnAt, Shaded } from "lpdeform-client";
import { drawInto, drawnAt, spread } from "lpdeform-client/mesh/drawmesh";
import type { Drawn } from "lpdeform-client/mesh/drawn";
import { blockBoxes, type FaceBlocks } from "lpdeform-client/mesh/face_blocks";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { Pairs } from "lpdeform-client/mesh/pairs";
import { type Hit, raycast } from "../model/raycast.js";
import type { ColourBy, View } from "../model/view.js";
import { isSoftware } from "./software.js";
import { colourByPixel, paint, surfaceMaterial } from "./surface_material.js";
import type { Textured } from "./textured.js";

/** The value for each colour. */
export interface Scale {
  low: number;
  red: number;
  isLogarithmic: boolean;
}

/** From this number of vertices on, the GPU is sent more than a picture has time for. */
export const largeVertices = 20_000;

/** With this many vertices, lighting per vertex looks like lighting per pixel. */
const denseVertices = 4000;

/** The surface of a pane: faces, wireframe, the original as a ghost. */
export class Surface {
  readonly group = new three.Group();
  /** The positions of the mesh's vertices, as drawn. */
  positions: Float32Array;
  readonly #derived: Derived;
  readonly #drawn: Drawn;
  #at: DrawnAt;
  /** Whether nobody else has those arrays. */
  #isOwn = false;
  /** The motion of a handle since the frame; each vertex goes along as far as pull() has said. */
  readonly ahead = { value: new three.Matrix4() };
  #pull: Float32Array | undefined;
  #drawnOf: Uint32Array | undefined;
  /** Of the present positions, once they are needed. */
  #blocks: FaceBlocks | undefined;
  readonly #geometry = new three.BufferGeometry();
  readonly #values: Float32Array;
  readonly #pulls: Float32Array;
  #shaded: Shaded | undefined;
  readonly #isPerVertex: boolean;
  readonly #material: three.ShaderMaterial;
  readonly #wire = new three.LineSegments(
    new three.BufferGeometry(),
    new three.LineBasicMaterial({ transparent: true, opacity: 0.35 }),
  );
  /** Attributes that the GPU does not have yet, one for each picture to come, and what sends them. Empty for small meshes. */
  readonly #unsent: string[] = [];
  readonly #sender: three.Points;
  readonly #ghost: three.Mesh;
  readonly #plain: three.Mesh;
  #textured: Textured | undefined;

  constructor(readonly mesh: Mesh) {
    this.positions = mesh.positions;
    this.#derived = derivedOf(mesh);
    const { drawn, atRest } = this.#derived.shown;
    this.#drawn = drawn;
    this.#at = atRest;
    this.#values = new Float32Array(drawn.source.length);
    this.#pulls = new Float32Array(drawn.source.length);
    this.#isPerVertex = isSoftware && mesh.positions.length > 3 * denseVertices;
    this.#material = surfaceMaterial(this.#isPerVertex, drawn.isClosed, this.ahead);
    const geometry = this.#geometry;
    const { center, diagonal } = this.#derived.bounds;
    geometry.boundingSphere = new three.Sphere(new three.Vector3(...center), diagonal / 2); // three.js sorts by it
    geometry.setIndex(new three.BufferAttribute(drawn.once, 1));
    geometry.setAttribute("position", live(this.#at.positions, 3));
    geometry.setAttribute("normal", live(this.#at.normals, 3));
    geometry.setAttribute("value", live(this.#values, 1));
    geometry.setAttribute("pull", live(this.#pulls, 1));
    this.#ghost = this.#makeGhost();
    this.#plain = new three.Mesh(geometry, this.#material);
    this.#sender = new three.Points(new three.BufferGeometry(), this.#material);
    this.#sender.geometry.setDrawRange(0, 0);
    this.#sender.geometry.boundingSphere = geometry.boundingSphere;
    if (mesh.positions.length > 3 * largeVertices) this.#unsent.push("position", "normal", "value", "pull");
    this.#plain.visible = this.#unsent.length === 0;
    for (const object of [this.#plain, this.#wire, this.#ghost, this.#sender]) {
      object.frustumCulled = false;
      this.group.add(object);
    }
    this.#wire.visible = this.#ghost.visible = false;
  }

  /**
   * Called before each picture. The vertices of a large mesh go to the GPU in several pictures, before it is seen; true if more of
   * them are needed.
   */
  send(): boolean {
    const next = this.#unsent.shift();
    if (next) this.#sender.geometry.setAttribute(next, this.#geometry.attributes[next]!);
    this.#showPlain();
    return this.#unsent.length > 0;
  }

  #showPlain(): void {
    this.#plain.visible = this.#unsent.length === 0 && !this.#isTextured;
    this.#sender.visible = this.#unsent.length > 0;
  }

  /** Where a ray first meets the surface. */
  hit(origin: readonly [number, number, number], direction: readonly [number, number, number]): Hit | undefined {
    const { positions, mesh } = this;
    const { order } = this.#derived;
    this.#blocks ??= { order, boxes: blockBoxes(positions, mesh.faces, order) };
    return raycast(positions, mesh.faces, origin, direction, this.#blocks);
  }

  /** For each vertex of the mesh one of those that are drawn; 2^32 - 1 if there is none. */
  get drawnOf(): Uint32Array {
    if (this.#drawnOf) return this.#drawnOf;
    const drawn = new Uint32Array(this.mesh.positions.length / 3).fill(0xffffffff);
    this.#drawn.source.forEach((vertex, k) => (drawn[vertex] = k));
    return (this.#drawnOf = drawn);
  }

  get adjacency(): Adjacency {
    return this.#derived.shown.adjacency;
  }

  /** Gives a geometry the vertices of this one. */
  share(geometry: three.BufferGeometry): void {
    for (const name of ["position", "pull"]) geometry.setAttribute(name, this.#geometry.attributes[name]!);
    geometry.boundingSphere = this.#geometry.boundingSphere;
  }

  /** `shares`: for each vertex of the mesh, how far it goes along with what is ahead; undefined: none does. */
  pull(shares: Float32Array | undefined): void {
    this.#pull = shares;
    if (!shares) {
      this.ahead.value.identity();
      return;
    }
    spread(shares, this.#drawn, this.#pulls);
    this.#show("pull", this.#pulls);
    if (this.#isTextured) this.#textured!.pull(this.#pulls);
  }

  /** Makes what is shown if colours are by texture. */
  dress(make: (indices: Uint32Array, makeMaterial: () => three.ShaderMaterial) => Textured): void {
    this.#textured = make(this.#drawn.indices, () => surfaceMaterial(this.#isPerVertex, this.#drawn.isClosed, this.ahead));
    this.#textured.object.visible = false;
    this.group.add(this.#textured.object);
  }

  get #isTextured(): boolean {
    return this.#textured?.object.visible === true;
  }

  /** Where a vertex is drawn. */
  placeOf(vertex: number): three.Vector3 {
    const at = new three.Vector3().fromArray(this.positions, 3 * vertex);
    return at.clone().lerp(at.applyMatrix4(this.ahead.value), this.#pull?.[vertex] ?? 0);
  }

  /** Positions of the mesh's vertices; the array is kept. `shaded`: what is drawn of them, if that was found elsewhere. */
  move(positions: Float32Array, shaded?: Shaded): void {
    this.positions = positions;
    const isOfThese = shaded?.positions.length === this.#at.positions.length; // not if the mesh was welded otherwise
    this.#shaded = isOfThese ? shaded : undefined;
    this.#blocks = this.#shaded && { order: this.#derived.order, boxes: this.#shaded.boxes };
    if (this.#shaded) this.#at = this.#shaded;
    else if (this.#isOwn) drawInto(this.#at, positions, this.#drawn);
    else this.#at = drawnAt(positions, this.#drawn);
    this.#isOwn = !this.#shaded;
    this.#show("position", this.#at.positions);
    this.#show("normal", this.#at.normals);
    if (this.#isTextured) this.#textured!.move(this.#at);
  }

  #show(name: "position" | "normal" | "value" | "pull", array: Float32Array): void {
    const attribute = this.#geometry.attributes[name] as three.BufferAttribute;
    attribute.array = array;
    attribute.needsUpdate = true;
  }

  /** `values`: of the mesh's vertices; 0 if all are. */
  colour(by: ColourBy, values: Float32Array | 0 | undefined, { low, red, isLogarithmic }: Scale): void {
    if (values === 0) {
      this.#values.fill(0);
      this.#show("value", this.#values);
    } else if (values && by === "distortion" && this.#shaded) {
      this.#show("value", this.#shaded.distortion);
    } else if (values) {
      spread(values, this.#drawn, this.#values);
      this.#show("value", this.#values);
    }
    const uniforms = this.#material.uniforms;
    uniforms["low"]!.value = low;
    uniforms["red"]!.value = red;
    uniforms["logarithmic"]!.value = isLogarithmic ? 1 : 0;
    uniforms["colourful"]!.value = values === undefined ? 0 : 1;
    colourByPixel(this.#material, by, this.#isPerVertex);
    this.#showTexture(by === "texture");
  }

  /** What has moved meanwhile is taken when it is shown. */
  #showTexture(isOn: boolean): void {
    if (!this.#textured || isOn === this.#isTextured) return;
    this.#textured.object.visible = isOn;
    this.#showPlain();
    if (!isOn) return;
    this.#textured.move(this.#at);
    this.#textured.pull(this.#pulls);
  }

  show({ wireframe, ghost, isDark, palette }: Pick<View, "wireframe" | "ghost" | "isDark" | "palette">): void {
    paint(this.#material, palette);
    if (wireframe) this.#findEdges();
    this.#wire.visible = wireframe;
    if (ghost) this.#findGhostFaces();
    this.#ghost.visible = ghost;
    (this.#wire.material as three.LineBasicMaterial).color.set(isDark ? "#05070c" : "#1b2436");
    (this.#ghost.material as three.MeshBasicMaterial).color.set(isDark ? "#b9c6dc" : "#4f5d75");
  }

  dispose(): void {
    this.#geometry.dispose();
    this.#sender.geometry.dispose();
    this.#wire.geometry.dispose();
    this.#ghost.geometry.dispose();
    for (const { material } of [this.#wire, this.#ghost]) (material as three.Material).dispose();
    this.#material.dispose();
    this.#textured?.dispose();
  }

  /** Once, when they are first needed, because it takes some time for large meshes. */
  #findEdges(): void {
    const { geometry } = this.#wire;
    if (geometry.index) return;
    const { once: indices, source } = this.#drawn;
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
    geometry.boundingSphere = this.#geometry.boundingSphere;
  }

  /** Once, when they are first needed, as in #findEdges(). */
  #findGhostFaces(): void {
    const { geometry } = this.#ghost;
    if (geometry.index) return;
    const { once, source } = this.#drawn;
    const faces = once.map((vertex) => source[vertex]!);
    geometry.setIndex(new three.BufferAttribute(faces, 1));
  }

  #makeGhost(): three.Mesh {
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(this.mesh.positions, 3));
    const { center, diagonal } = this.#derived.bounds;
    geometry.boundingSphere = new three.Sphere(new three.Vector3(...center), diagonal / 2);
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
