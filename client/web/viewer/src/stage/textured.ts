import * as three from "three";
import { Pairs } from "lpdeform-client/mesh/pairs";
import type { Texturing, TextureLayer } from "../model/texturing.js";

/** What is drawn of a surface, as DrawMesh has it. */
interface Drawn {
  indices: Uint32Array;
  positions: Float32Array;
  normals: Float32Array;
}

/** A surface with images on it. Its vertices are those that are drawn otherwise, split where an image ends or begins again. */
export class Textured {
  readonly object: three.Mesh;
  /** For each vertex the one that is drawn otherwise. */
  readonly #source: Uint32Array;
  readonly #materials: readonly three.ShaderMaterial[];
  readonly #textures: three.Texture[] = [];
  readonly #geometry = new three.BufferGeometry();

  /** `images`: those of the layers, which the object closes in the end. `makeMaterial`: the surface's, for one layer. */
  constructor(
    { indices }: Pick<Drawn, "indices">,
    { coordinates, corners, layers }: Texturing,
    images: readonly (ImageBitmap | undefined)[],
    makeMaterial: () => three.ShaderMaterial,
  ) {
    const known = new Pairs(indices.length);
    const source: number[] = [];
    const places: number[] = [];
    const own = indices.map((drawn, corner) => {
      const place = corners[corner]!;
      const before = known.get(drawn, place);
      if (before >= 0) return before;
      known.set(drawn, place, source.length);
      places.push(coordinates[2 * place]!, coordinates[2 * place + 1]!);
      return source.push(drawn) - 1;
    });
    this.#source = Uint32Array.from(source);
    this.#geometry.setIndex(new three.BufferAttribute(own, 1));
    for (const name of ["position", "normal", "pull"] as const) {
      const width = name === "pull" ? 1 : 3;
      const array = new Float32Array(width * source.length);
      this.#geometry.setAttribute(name, new three.BufferAttribute(array, width).setUsage(three.DynamicDrawUsage));
    }
    this.#geometry.setAttribute("place", new three.Float32BufferAttribute(places, 2));
    layers.forEach(({ firstFace, faceCount }, k) => this.#geometry.addGroup(3 * firstFace, 3 * faceCount, k));
    this.#materials = layers.map((layer, k) => layerMaterial(makeMaterial(), layer, this.#textureOf(images[k], layer)));
    this.object = new three.Mesh(this.#geometry, [...this.#materials]);
    this.object.frustumCulled = false;
  }

  /** The same for layers that show an image alike. */
  #textureOf(image: ImageBitmap | undefined, { isRepeated }: TextureLayer): three.Texture | undefined {
    if (!image) return undefined;
    const wrap = isRepeated ? three.RepeatWrapping : three.ClampToEdgeWrapping;
    const known = this.#textures.find((texture) => texture.image === image && texture.wrapS === wrap);
    if (known) return known;
    const texture = new three.Texture(image);
    texture.flipY = false;
    texture.wrapS = texture.wrapT = wrap;
    texture.anisotropy = 4;
    texture.needsUpdate = true;
    this.#textures.push(texture);
    return texture;
  }

  move({ positions, normals }: Pick<Drawn, "positions" | "normals">): void {
    this.#take("position", positions, 3);
    this.#take("normal", normals, 3);
  }

  pull(pulls: Float32Array): void {
    this.#take("pull", pulls, 1);
  }

  #take(name: string, from: Float32Array, width: number): void {
    const attribute = this.#geometry.attributes[name] as three.BufferAttribute;
    const { array } = attribute;
    for (let k = 0, at = 0; k < this.#source.length; ++k) {
      for (let begin = width * this.#source[k]!, axis = 0; axis < width; ++axis) array[at++] = from[begin + axis]!;
    }
    attribute.needsUpdate = true;
  }

  dispose(): void {
    this.#geometry.dispose();
    for (const material of this.#materials) material.dispose();
    for (const texture of this.#textures) texture.dispose();
    closeAll(this.#textures.map(({ image }) => image as ImageBitmap));
  }
}

function layerMaterial(
  material: three.ShaderMaterial,
  { colour }: TextureLayer,
  texture: three.Texture | undefined,
): three.ShaderMaterial {
  const { r, g, b } = new three.Color(...colour).convertLinearToSRGB();
  material.uniforms["plain"]!.value = new three.Vector3(r, g, b);
  material.uniforms["colourful"]!.value = 0;
  if (!texture) return material;
  material.uniforms["image"] = { value: texture };
  material.defines = { ...material.defines, TEXTURED: "" };
  return material;
}

/** Each image once. Undefined for those that cannot be shown. */
export function decoded(layers: readonly TextureLayer[]): Promise<(ImageBitmap | undefined)[]> {
  const known = new Map<Blob, Promise<ImageBitmap | undefined>>();
  const decode = (image: Blob) => {
    const bitmap = createImageBitmap(image, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    return bitmap.catch(() => undefined);
  };
  for (const { image } of layers) if (image && !known.has(image)) known.set(image, decode(image));
  return Promise.all(layers.map(({ image }) => image && known.get(image)));
}

export function closeAll(images: readonly (ImageBitmap | undefined)[]): void {
  for (const image of new Set(images)) image?.close();
}
