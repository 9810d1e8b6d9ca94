import { parseMesh } from "lpdeform-client/mesh/read";
import { expect, it } from "vitest";
import { rewriteObj } from "../src/io/obj_rewrite.js";
import { materialFiles, readObjTextures } from "../src/io/obj_textures.js";
import { storedMesh } from "../src/io/project_mesh.js";

const obj = `mtllib a.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
vt 0 0
vt 1 0
usemtl wood, old
f 1/1 2/2 3/-1 4/1
usemtl plain
f 2 5 3
vt 0.25 0.75
usemtl wood, old
f 2/3 5/1 3/2
`;
const mtl = `# by hand
newmtl wood, old
Kd 1 1 1
map_Kd -s 2 2 -clamp on -bm 0.5 textures\\Old Wood.png
newmtl plain
Kd 0.5 0 1
`;
const wood = new Blob(["wood"]);
const bytes = new TextEncoder().encode(obj);
const read = (files: Record<string, Blob>) => readObjTextures(bytes, files);

it("images and colours of an OBJ's materials are found in the files that were opened with it", async () => {
  const { coordinates, corners, layers, missing } = await read({ "a.mtl": new Blob([mtl]), "old wood.PNG": wood });
  expect([...coordinates]).toEqual([0, 1, 1, 1, 0.25, 0.25]); // from the upper left corner
  // The fan of the quad, then the corners without places, then the last face.
  expect([...corners]).toEqual([0, 1, 1, 0, 1, 0, 0, 0, 0, 2, 0, 1]);
  expect(layers.map(({ firstFace, faceCount, isRepeated }) => [firstFace, faceCount, isRepeated])).toEqual([
    [0, 2, false],
    [2, 1, true],
    [3, 1, false],
  ]);
  expect(layers.map(({ image }) => image)).toEqual([wood, undefined, wood]);
  expect(layers[0]!.colour).toEqual([1, 1, 1]);
  expect(layers[1]!.colour.map((value) => Number(value.toFixed(3)))).toEqual([0.214, 0, 1]);
  expect(missing).toEqual([]);
});

it("an image that is not there is named, and a material that is not there is white", async () => {
  const { layers, missing } = await read({ "a.mtl": new Blob([mtl.replace("plain", "other")]) });
  expect(missing).toEqual(["textures\\Old Wood.png"]);
  expect(layers.map(({ image }) => image)).toEqual([undefined, undefined, undefined]);
  expect(layers[1]!.colour).toEqual([1, 1, 1]);
});

it.each(["map_Kd", "map_Kd -s", "map_Kd -o 1 2", "Kd", "Kd 1 -1 x", "newmtl", "map_Kd -bm"])(
  "an MTL with the line “%s” is read as far as it goes",
  async (line) => {
    const { corners, coordinates, layers } = await read({ "a.mtl": new Blob([`newmtl plain\n${line}\n`]) });
    expect(Math.max(...corners)).toBeLessThan(coordinates.length / 2);
    for (const { colour } of layers) expect(colour.every(Number.isFinite)).toBe(true);
  },
);

it("the files are kept with the mesh, and the OBJ that is saved is as it was", async () => {
  const encoded = new TextEncoder().encode(mtl);
  const mesh = parseMesh("a.obj", bytes, new Map([["a.mtl", encoded]]));
  expect(Object.keys(mesh.materials!)).toEqual(["a.mtl"]);
  expect(parseMesh("a.obj", bytes, new Map([["a.png", encoded]])).materials).toBeUndefined();
  expect(rewriteObj({ ...mesh, obj: mesh.obj! }, mesh.positions)).toEqual(bytes);
  expect((await storedMesh(mesh)).arrays).toEqual({ obj: bytes, "materials/a.mtl": encoded });
});

it("materials come from the MTL files that the OBJ names, and from the others only if none of those is there", async () => {
  const other = new Blob(["newmtl plain\nKd 1 0 0\n"]);
  const own = new Blob([mtl]);
  for (const files of [
    { "A.MTL": own, "b.mtl": other },
    { "b.mtl": other, "A.MTL": own },
  ]) {
    expect((await read(files)).layers[1]!.colour[2]).toBe(1);
  }
  expect((await read({ "b.mtl": other })).layers[1]!.colour).toEqual([1, 0, 0]);
  const two = new TextEncoder().encode(obj.replace("a.mtl", "maps/b.mtl a.mtl"));
  expect((await readObjTextures(two, { "a.mtl": own, "b.mtl": other })).layers[1]!.colour).toEqual([1, 0, 0]); // the first
});

it("of the files beside an OBJ, those are read that its materials name", async () => {
  const files = ["a.MTL", "OLD wood.png", "photo.png", "notes.txt"].map((name) => new File([mtl], name));
  expect((await materialFiles(files)).map(({ name }) => name)).toEqual(["a.MTL", "OLD wood.png"]);
});

it("a material may change at every face, and the page goes on while it is read", async () => {
  const count = 30_000;
  const lines = Array.from({ length: count }, (_, k) => `usemtl ${k % 2 ? "plain" : "wood, old"}\nf 1 2 3`);
  const text = `mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n${lines.join("\n")}\n`;
  let turns = 0;
  const turning = setInterval(() => ++turns);
  const { layers } = await readObjTextures(new TextEncoder().encode(text), { "a.mtl": new Blob([mtl]) });
  clearInterval(turning);
  expect(layers).toHaveLength(count);
  expect(turns).toBeGreaterThan(5); // something else had its turn in between
});

it("the page goes on while a long MTL is read", async () => {
  const long = Array.from({ length: 30_000 }, (_, k) => `newmtl m${k}\nKd 1 0 0\nmap_Kd ${k}.png`).join("\n");
  let turns = 0;
  const turning = setInterval(() => ++turns);
  const files = [new File([long], "a.mtl"), new File([], "29999.png"), new File([], "photo.png")];
  expect((await materialFiles(files)).map(({ name }) => name)).toEqual(["a.mtl", "29999.png"]);
  clearInterval(turning);
  expect(turns).toBeGreaterThan(5);
});
