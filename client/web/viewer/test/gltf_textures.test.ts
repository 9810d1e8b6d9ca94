import { ShaderMaterial } from "three";
import { expect, it, vi } from "vitest";
import { readGltfTextures } from "../src/io/gltf_textures.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { readGltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
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

it("layers that show an image alike share its decoding and its texture, and close it once", async () => {
  let [decodings, closings] = [0, 0];
  const bitmap = { close: () => ++closings } as unknown as ImageBitmap;
  vi.stubGlobal("createImageBitmap", async () => (++decodings, bitmap));
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
