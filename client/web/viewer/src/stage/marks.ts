import * as three from "three";
import type { Handle } from "../model/document.js";
import { type Ahead, before, place } from "./ahead.js";
import { follow, type Places, placesOf } from "../model/places.js";

const vertexShader = `
attribute vec3 colour;
attribute float size;
${place}
${before}
uniform float pixelRatio;
varying vec3 vColour;
varying float vRing;
void main() {
  vColour = colour;
  vRing = smoothstep(6.5, 8.5, size);
  gl_Position = projectionMatrix * before(modelViewMatrix * vec4(placed(), 1.0));
  gl_PointSize = size * pixelRatio;
}`;

const fragmentShader = `
varying vec3 vColour;
varying float vRing;
void main() {
  float far = 2.0 * length(gl_PointCoord - 0.5);
  if (far > 1.0) discard;
  gl_FragColor = vec4(mix(vColour, vec3(1.0), vRing * smoothstep(0.62, 0.72, far)), 1.0);
}`;

/** Points on the surface: handles in their colours. */
export class Marks {
  readonly object: three.Points;
  readonly #material = new three.ShaderMaterial({
    vertexShader,
    fragmentShader,
    uniforms: { pixelRatio: { value: 1 }, ahead: { value: new three.Matrix4() } },
  });
  #places: Places = { corners: [], weights: [] };
  #shown: readonly unknown[] = [];

  constructor() {
    this.object = new three.Points(new three.BufferGeometry(), this.#material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 1;
  }

  /** `ahead`: the uniform of the surface on which they lie. */
  attach(ahead: Ahead): void {
    this.#material.uniforms["ahead"] = ahead;
  }

  /** Marks those vertices as pulled along by what is ahead. */
  pull(shares: Float32Array | undefined): void {
    const pull = this.object.geometry.attributes["pull"] as three.BufferAttribute | undefined;
    if (!pull) return;
    const { corners } = this.#places;
    for (let k = 0; k < pull.count; ++k) pull.array[k] = shares?.[corners[3 * k]!] ?? 0;
    pull.needsUpdate = true;
  }

  /** `faces`: of the mesh. Returns true if other points are marked than before, which are not at their places yet. */
  show(handles: readonly Handle[], faces: Uint32Array, selected: readonly string[]): boolean {
    const shown = [
      faces,
      ...selected,
      ...handles.flatMap(({ name, vertices, points, colour }) => [name, vertices, points, colour]),
    ];
    if (shown.length === this.#shown.length && shown.every((one, k) => one === this.#shown[k])) return false;
    this.#shown = shown;
    const corners: number[] = [];
    const weights: number[] = [];
    const colours: number[] = [];
    const sizes: number[] = [];
    const add = (places: Places, colour: string, size: number) => {
      const { r, g, b } = new three.Color().setStyle(colour, three.LinearSRGBColorSpace);
      for (let k = 0; k < places.corners.length; k += 3) {
        for (let corner = k; corner < k + 3; ++corner) {
          corners.push(places.corners[corner]!);
          weights.push(places.weights[corner]!);
        }
        colours.push(r, g, b);
        sizes.push(size);
      }
    };
    for (const { name, vertices, points, colour } of handles) {
      const places = placesOf(vertices, points, faces);
      const count = places.corners.length / 3;
      const small = count > 400 ? 4 : count > 60 ? 5 : count > 4 ? 8 : 11;
      add(places, colour, selected.includes(name) ? small + 1.5 : small);
    }
    this.#places = { corners, weights };
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.BufferAttribute(new Float32Array(corners.length), 3));
    geometry.setAttribute("colour", new three.BufferAttribute(new Float32Array(colours), 3));
    geometry.setAttribute("pull", new three.BufferAttribute(new Float32Array(sizes.length), 1));
    geometry.setAttribute("size", new three.BufferAttribute(new Float32Array(sizes), 1));
    this.object.geometry.dispose();
    this.object.geometry = geometry;
    return true;
  }

  /** Follows the surface. */
  move(positions: Float32Array): void {
    const attribute = this.object.geometry.attributes["position"] as three.BufferAttribute | undefined;
    if (!attribute) return;
    follow(this.#places, positions, attribute.array as Float32Array);
    attribute.needsUpdate = true;
  }

  scale(pixelRatio: number): void {
    this.#material.uniforms["pixelRatio"]!.value = pixelRatio;
  }
}
