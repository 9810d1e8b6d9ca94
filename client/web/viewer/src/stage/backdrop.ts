import * as three from "three";

const light = ["#dfe5ee", "#f8fafc"] as const;
const dark = ["#10151f", "#2a3446"] as const;

/**
 * The background of the surface: two colours, blended from bottom to top. It is part of the picture; an opaque picture is
 * displayed faster.
 */
export class Backdrop {
  readonly object: three.Mesh;
  readonly #material = new three.ShaderMaterial({
    vertexShader:
      "varying float vHeight; void main() { vHeight = 0.5 + 0.5 * position.y; gl_Position = vec4(position.xy, 1.0, 1.0); }",
    fragmentShader:
      "uniform vec3 low; uniform vec3 high; varying float vHeight; void main() { gl_FragColor = vec4(mix(low, high, vHeight), 1.0); }",
    depthTest: false,
    depthWrite: false,
    uniforms: { low: { value: new three.Vector3() }, high: { value: new three.Vector3() } },
  });

  constructor() {
    const geometry = new three.BufferGeometry();
    geometry.setAttribute("position", new three.Float32BufferAttribute([-1, -1, 0, 3, -1, 0, -1, 3, 0], 3));
    this.object = new three.Mesh(geometry, this.#material);
    this.object.frustumCulled = false;
    this.object.renderOrder = -1;
    this.darken(false);
  }

  darken(isDark: boolean): void {
    const [low, high] = (isDark ? dark : light).map((colour) => new three.Color().setStyle(colour, three.LinearSRGBColorSpace));
    this.#material.uniforms["low"]!.value.set(low!.r, low!.g, low!.b);
    this.#material.uniforms["high"]!.value.set(high!.r, high!.g, high!.b);
  }
}
