import { ShaderMaterial } from "three";
import { expect, it, vi } from "vitest";
import { readGltfTextures } from "../src/io/gltf_textures.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { readGltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
import { gathered } from "../src/model/texturing.js";
import { decoded, Textured } from "../src/stage/textured.js";
import { columns, makeGlb } from "./made_glb.js";
import { pngOf } from "./png.js";

const picture = pngOf(2, 1, [255, 0, 0, 0, 255, 0]);

it("a texture has a place for each corner, and the image of the file", async () => {
  const glb = makeGlb(false, picture);
  const { coordinates, corners, layers } = readGltfTextures("a.glb", glb);
  const mesh = parseMesh("a.glb", glb);
  expect(corners).toEqual(mesh.faces);
  expect(layers.map(({ faceCount }) => faceCount).reduce((sum, count) => sum + count)).toBe(mesh.faces.length / 3);
  const at = 2 * (3 * (columns + 1) + 4); // row 3, column 4
  expect([...coordinates.subarray(at, at + 2)]).toEqual([Math.fround(4 / columns), Math.fround(3 / 16)]);
  expect(new Uint8Array(await layers[0]!.image!.arrayBuffer())).toEqual(new Uint8Array(picture));
  expect(layers[0]).toMatchObject({ colour: [1, 1, 1], isRepeated: true });
});

it("primitives with one image share it, and those with other places for the same vertices keep theirs", () => {
  const document = readGltfDocument("a.glb", makeGlb(false, picture), new Map());
  const [{ primitives }] = document.json["meshes"] as [{ primitives: { attributes: Record<string, number> }[] }];
  const accessors = document.json["accessors"] as object[];
  const { attributes } = primitives[0]!;
  const other = accessors.push({ ...accessors[attributes["NORMAL"]!], type: "VEC2" }) - 1;
  primitives.push({ ...primitives[0]!, attributes: { ...attributes, TEXCOORD_0: other } });
  const { coordinates, corners, layers } = readGltfTextures("a.glb", writeGlb(document));
  expect(new Set(layers.map(({ image }) => image)).size).toBe(1);
  const placesOf = (layer: number) =>
    [0, 2].map((corner) => {
      const place = corners[3 * layers[layer]!.firstFace + corner]!;
      return [...coordinates.subarray(2 * place, 2 * place + 2)];
    });
  const along = Math.fround(1 / columns);
  expect(placesOf(0)).toEqual([
    [0, 0],
    [along, 0],
  ]);
  expect(placesOf(1)).toEqual([
    [1, 0],
    [0, Math.fround(Math.cos(Math.PI / 6))],
  ]);
});

/** Images of these sizes, or of the other one; without a size, they cannot be shown. */
function stubImages(sizes: ReadonlyMap<Blob, readonly [number, number]>, other?: readonly [number, number]): void {
  const known = new Map<string, readonly [number, number] | undefined>();
  vi.spyOn(URL, "createObjectURL").mockImplementation((image) => {
    const address = `image ${known.size}`;
    known.set(address, sizes.get(image as Blob) ?? other);
    return address;
  });
  class FakeImage {
    naturalWidth = 0;
    naturalHeight = 0;
    onload = () => undefined;
    onerror = () => undefined;
    set src(address: string) {
      const size = known.get(address);
      if (size) [this.naturalWidth, this.naturalHeight] = size;
      queueMicrotask(size ? this.onload : this.onerror);
    }
  }
  vi.stubGlobal("Image", FakeImage);
}

const layerWith = (image: Blob) => ({ firstFace: 0, faceCount: 1, image, colour: [1, 1, 1] as const, isRepeated: true });

it("an image of too many pixels is not decoded, and many are decoded smaller, one after the other", async () => {
  const [huge, broken, a, b] = [1, 2, 3, 4].map((k) => new Blob([`${k}`])) as [Blob, Blob, Blob, Blob];
  stubImages(
    new Map([
      [huge, [100_000, 100_000]],
      [a, [10_000, 10_000]],
      [b, [10_000, 5000]],
    ]),
  );
  const asked: [Blob, number, number][] = [];
  let [running, most] = [0, 0];
  vi.stubGlobal("createImageBitmap", async (image: Blob, { resizeWidth, resizeHeight }: ImageBitmapOptions) => {
    most = Math.max(most, ++running);
    asked.push([image, resizeWidth!, resizeHeight!]);
    await Promise.resolve();
    --running;
    return { close: () => undefined };
  });
  const images = await decoded([huge, broken, a, b, a].map(layerWith));
  expect(images.map((image) => image !== undefined)).toEqual([false, false, true, true, true]);
  expect([images[2] === images[4], most, asked.map(([image]) => image)]).toEqual([true, 1, [a, b]]);
  const pixels = asked.reduce((sum, [, width, height]) => sum + width * height, 0);
  expect(pixels).toBeLessThanOrEqual(2 ** 27);
  expect(pixels).toBeGreaterThan(0.99 * 2 ** 27);
});

it("faces that look alike are one layer, in any order in the file", () => {
  const image = new Blob(["a"]);
  const layer = (firstFace: number, other: object) => ({ ...layerWith(image), firstFace, ...other });
  const layers = [layer(0, {}), layer(1, { isRepeated: false }), layer(2, { faceCount: 2 })];
  const { coordinates, corners } = { coordinates: Float32Array.of(0, 0), corners: new Uint32Array(12) };
  const texturing = gathered({ coordinates, corners, layers });
  expect(texturing.layers.map(({ firstFace, faceCount }) => [firstFace, faceCount])).toEqual([
    [0, 3],
    [3, 1],
  ]);
  expect([...texturing.order!]).toEqual([0, 2, 3, 1]);
  const indices = Uint32Array.from({ length: 12 }, (_, k) => k);
  const material = () => new ShaderMaterial({ uniforms: { plain: { value: 0 }, colourful: { value: 0 } } });
  const textured = new Textured({ indices }, texturing, [], material);
  expect([...textured.object.geometry.index!.array]).toEqual([0, 1, 2, 6, 7, 8, 9, 10, 11, 3, 4, 5]);

  const many = Array.from({ length: 100_000 }, (_, k) => layer(k, { isRepeated: k % 2 === 0 }));
  expect(gathered({ coordinates, corners, layers: many }).layers).toHaveLength(2);
  const different = many.slice(0, 513).map((one, k) => ({ ...one, colour: [k / 513, 0, 0] as const }));
  expect(() => gathered({ coordinates, corners, layers: different })).toThrow("513 different materials; this page shows 512");
});

it("layers that show an image alike share its decoding and its texture, and close it once", async () => {
  let [decodings, closings] = [0, 0];
  const bitmap = { close: () => ++closings } as unknown as ImageBitmap;
  vi.stubGlobal("createImageBitmap", async () => (++decodings, bitmap));
  stubImages(new Map(), [2, 1]);
  const image = new Blob([picture]);
  const layers = [true, true, false].map((isRepeated, k) => {
    const colour = [1, 1, 1] as const;
    return { firstFace: k, faceCount: 1, image, colour, isRepeated };
  });
  const images = await decoded(layers);
  expect([images, decodings]).toEqual([[bitmap, bitmap, bitmap], 1]);
  const indices = Uint32Array.from([0, 1, 2, 0, 1, 2, 0, 1, 2]);
  const texturing = { coordinates: new Float32Array(6), corners: indices, layers };
  const material = () => new ShaderMaterial({ uniforms: { plain: { value: 0 }, colourful: { value: 0 } } });
  const textured = new Textured({ indices }, texturing, images, material);
  const [a, b, c] = (textured.object.material as ShaderMaterial[]).map(({ uniforms }) => uniforms["image"]!.value);
  expect([a === b, b === c]).toEqual([true, false]);
  textured.dispose();
  expect(closings).toBe(1);
});

it("a material without an image has its colour, and a primitive without a material is white", () => {
  const document = readGltfDocument("a.glb", makeGlb(true), new Map());
  const meshes = document.json["meshes"] as { primitives: object[] }[];
  const bare = readGltfTextures("a.glb", writeGlb(document)).layers;
  expect(bare).toEqual([{ firstFace: 0, faceCount: bare[0]!.faceCount, colour: [1, 1, 1], isRepeated: true }]);
  Object.assign(meshes[0]!.primitives[0]!, { material: 0 });
  document.json["materials"] = [{ pbrMetallicRoughness: { baseColorFactor: [0.5, 0.25, 0, 1] } }];
  const [layer] = readGltfTextures("a.glb", writeGlb(document)).layers;
  expect(layer).toMatchObject({ colour: [0.5, 0.25, 0] });
  expect(layer!.image).toBeUndefined();
  Object.assign(meshes[0]!.primitives[0]!, { material: 7 });
  expect(() => readGltfTextures("a.glb", writeGlb(document))).toThrow("names none of the 1 materials");
});
