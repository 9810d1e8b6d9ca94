import * as three from "three";
import { Pairs } from "lpdeform-client/mesh/pairs";
import type { DrawnAt } from "lpdeform-client";
import type { Drawn } from "lpdeform-client/mesh/drawn";
import type { Texturing, TextureLayer } from "../model/texturing.js";

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
    { coordinates, corners, layers, order }: Texturing,
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
    const ordered = order ? own.map((_, corner) => own[3 * order[Math.floor(corner / 3)]! + (corner % 3)]!) : own;
    this.#geometry.setIndex(new three.BufferAttribute(ordered, 1));
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

  move({ positions, normals }: Pick<DrawnAt, "positions" | "normals">): void {
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

/** An image with more pixels is not shown: while it is decoded, it takes four bytes for each. */
const mostPixels = 2 ** 27;

/**
 * Each image once, one after the other. If all together have more than 2^27 pixels, they are made smaller. Undefined for those that
 * the browser cannot show, and for those with more than 2^27 pixels.
 */
export async function decoded(layers: readonly TextureLayer[]): Promise<(ImageBitmap | undefined)[]> {
  const sizes = new Map<Blob, Size>();
  for (const image of new Set(layers.map((layer) => layer.image))) {
    const size = image && (await sizeOf(image));
    if (size && size.width * size.height <= mostPixels) sizes.set(image, size);
  }
  const pixels = [...sizes.values()].reduce((sum, { width, height }) => sum + width * height, 0);
  const share = Math.min(1, Math.sqrt(mostPixels / pixels));
  const images = new Map<Blob, ImageBitmap | undefined>();
  for (const [image, size] of sizes) images.set(image, await bitmapOf(image, size, share).catch(() => undefined));
  return layers.map(({ image }) => image && images.get(image));
}

interface Size {
  width: number;
  height: number;
}

/** Found without decoding the image. Undefined if the browser cannot show it. */
async function sizeOf(blob: Blob): Promise<Size | undefined> {
  const image = new Image();
  const address = URL.createObjectURL(blob);
  try {
    await new Promise((done, failed) => {
      image.onload = done;
      image.onerror = failed;
      image.src = address;
    });
    return { width: image.naturalWidth, height: image.naturalHeight };
  } catch {
    return undefined;
  } finally {
    URL.revokeObjectURL(address);
  }
}

function bitmapOf(image: Blob, { width, height }: Size, share: number): Promise<ImageBitmap> {
  const smaller = (length: number) => Math.max(1, Math.floor(share * length));
  return createImageBitmap(image, {
    colorSpaceConversion: "none",
    premultiplyAlpha: "none",
    ...(share < 1 && { resizeWidth: smaller(width), resizeHeight: smaller(height) }),
  });
}

export function closeAll(images: readonly (ImageBitmap | undefined)[]): void {
  for (const image of new Set(images)) image?.close();
}
