import { expect, it } from "vitest";
import { readGltfTextures } from "../src/io/gltf_textures.js";
import { readMesh } from "../src/io/read.js";
import { readGltfDocument, writeGlb } from "../src/io/gltf_document.js";
import { columns, makeGlb } from "./made_glb.js";
import { pngOf } from "./png.js";

const picture = pngOf(2, 1, [255, 0, 0, 0, 255, 0]);

it("a texture has a place for each corner, and the image of the file", async () => {
  const glb = makeGlb(false, picture);
  const { coordinates, corners, layers } = readGltfTextures("a.glb", glb);
  const mesh = readMesh("a.glb", glb);
  expect(corners).toEqual(mesh.faces);
  expect(layers.map(({ faceCount }) => faceCount).reduce((sum, count) => sum + count)).toBe(mesh.faces.length / 3);
  const at = 2 * (3 * (columns + 1) + 4); // row 3, column 4
  expect([...coordinates.subarray(at, at + 2)]).toEqual([Math.fround(4 / columns), Math.fround(3 / 16)]);
  expect(new Uint8Array(await layers[0]!.image!.arrayBuffer())).toEqual(new Uint8Array(picture));
  expect(layers[0]).toMatchObject({ colour: [1, 1, 1], isRepeated: true });
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
