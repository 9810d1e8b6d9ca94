import * as three from "three";
import { before, place } from "./ahead.js";
import type { Surface } from "./surface.js";

const vertexShader = `
${place}
${before}
uniform float size;
void main() {
  gl_Position = projectionMatrix * before(modelViewMatrix * vec4(placed(), 1.0));
  gl_PointSize = size;
}`;

const fragmentShader = `
uniform vec3 colour;
void main() {
  float far = 2.0 * length(gl_PointCoord - 0.5);
  if (far > 1.0) discard;
  gl_FragColor = vec4(mix(colour, vec3(1.0), smoothstep(0.62, 0.72, far)), 1.0);
}`;

const size = 9;
const nowhere = 0xffffffff;

/**
 * Points on vertices that a brush or a warning highlights. They are drawn from the surface's own vertices, so they follow it
 * without any work, and vertices that are added to a list are all that is sent to the GPU.
 */
export class PointedMarks {
  readonly object: three.Points;
  readonly #uniforms = { size: { value: size }, colour: { value: new three.Vector3() }, ahead: { value: new three.Matrix4() } };
  #surface: Surface | undefined;
  #shown: readonly number[] = [];
  #count = 0;

  constructor() {
    const material = new three.ShaderMaterial({ vertexShader, fragmentShader, uniforms: this.#uniforms });
    this.object = new three.Points(new three.BufferGeometry(), material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 1;
    this.object.visible = false;
  }

  attach(surface: Surface): void {
    this.#surface = surface;
    this.#uniforms.ahead = surface.ahead;
    (this.object.material as three.ShaderMaterial).uniforms["ahead"] = surface.ahead;
    this.#clear(1024);
  }

  show(vertices: readonly number[], colour: string): void {
    const { r, g, b } = new three.Color().setStyle(colour, three.LinearSRGBColorSpace);
    this.#uniforms.colour.value.set(r, g, b);
    const before = this.#shown;
    const isMore = vertices.length >= before.length && before.every((vertex, k) => vertices[k] === vertex);
    const room = this.object.geometry.index?.count ?? 0;
    if (!isMore || vertices.length > room) this.#clear(Math.max(1024, 2 * vertices.length));
    this.#add(vertices.slice(this.#shown.length));
    this.#shown = vertices;
    this.object.visible = this.#count > 0;
  }

  scale(pixelRatio: number): void {
    this.#uniforms.size.value = size * pixelRatio;
  }

  dispose(): void {
    this.#dropGeometry();
    (this.object.material as three.Material).dispose();
  }

  #clear(room: number): void {
    this.#shown = [];
    this.#count = 0;
    this.#dropGeometry();
    this.object.geometry = new three.BufferGeometry();
    this.object.geometry.setIndex(new three.BufferAttribute(new Uint32Array(room), 1).setUsage(three.DynamicDrawUsage));
    this.#surface?.share(this.object.geometry);
    this.object.geometry.setDrawRange(0, 0);
  }

  /** Without what it shares with the surface, whose buffers would be deleted with it. */
  #dropGeometry(): void {
    const { geometry } = this.object;
    for (const name of Object.keys(geometry.attributes)) geometry.deleteAttribute(name);
    geometry.dispose();
  }

  #add(vertices: readonly number[]): void {
    const index = this.object.geometry.index!;
    const begin = this.#count;
    for (const vertex of vertices) {
      const drawn = this.#surface?.drawnOf[vertex] ?? nowhere;
      if (drawn !== nowhere) index.array[this.#count++] = drawn;
    }
    if (this.#count === begin) return;
    index.addUpdateRange(begin, this.#count - begin);
    index.needsUpdate = true;
    this.object.geometry.setDrawRange(0, this.#count);
  }
}
