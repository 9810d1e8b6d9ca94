import { expect, it } from "vitest";
import { FileFault } from "lpdeform-client/mesh/fault";
import { readGltfDocument } from "lpdeform-client/mesh/gltf_document";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { parseMesh } from "lpdeform-client/mesh/read";
import { rewriteGlb } from "../src/io/gltf_rewrite.js";
import { rewriteObj } from "../src/io/obj_rewrite.js";
import { lostIn } from "./gltf_kept.js";
import { faultsOf } from "./gltf_validator.js";
import { type Sample, samplesOf } from "./samples.js";

/** The mesh, or why there is none. */
function read({ name, bytes, beside }: Sample): Mesh | string {
  try {
    return parseMesh(name, bytes, beside);
  } catch (error) {
    if (error instanceof FileFault) return error.message;
    throw error;
  }
}

/** Bent, so that everything moves. */
const bent = ({ positions, exact }: Mesh) =>
  Float64Array.from(exact ?? positions, (value, k) => value + (k % 3 === 0 ? 0.1 * Math.sin(value + positions[k + 1]!) : 0));

const all = samplesOf(/\.(glb|gltf|off|obj|ply|stl)$/i).map((sample) => ({ ...sample, mesh: read(sample) }));
const opened = all.flatMap(({ path, mesh }) => (typeof mesh === "string" ? [] : [[path, mesh] as const]));
const isValid = async (bytes: Uint8Array) => (await faultsOf(bytes)).length === 0;

it("most samples are opened, of each format, and the others refused by a sentence that names what is wrong", () => {
  for (const format of ["glb", "gltf", "off", "obj", "ply", "stl"]) {
    const isOf = (path: string) => path.toLowerCase().endsWith(`.${format}`);
    expect(opened.filter(([path]) => isOf(path)).length).toBeGreaterThan(0);
  }
  expect(opened.length).toBeGreaterThan(all.length / 2);
  const refusals = all.flatMap(({ mesh }) => (typeof mesh === "string" ? [mesh] : []));
  for (const words of refusals) expect(words).toMatch(/^(\S+\.\w+|[A-Z“])[^\n]* [^\n]*\.$/u);
});

it.each([
  ["glTF2/BoxTextured-glTF-techniqueWebGL/BoxTextured.gltf", "The extension “KHR_technique_webgl” is required by the file"],
  ["glTF2/draco/2CylinderEngine.gltf", "Primitive 0 of mesh 23 (“body”) is compressed by KHR_draco_mesh_compression"],
  ["glTF2/IndexOutOfRange/IndexOutOfRange.gltf", "Primitive 0 of mesh 0 (“Mesh”) names by index 0 vertex 255 of 24"],
  ["glTF2/MissingBin/BoxTextured.gltf", "Buffer 0 of BoxTextured.gltf is not in the file; open it together"],
  ["glTF2/RecursiveNodes/RecursiveNodes.gltf", "Node 0 is reached twice"],
  ["glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb", "BoxWithInfinites.glb, node 1: a vertex has no three finite"],
  ["glTF/TwoBoxes/TwoBoxes.gltf", "TwoBoxes.gltf is no glTF of version 2"],
  ["invalid/malformed.obj", "malformed.obj, line 23: face 1 has the corner “12”; there are 8 vertices"],
  ["OBJ/box_UTF16BE.obj", "box_UTF16BE.obj is in UTF-16"],
  ["OBJ/number_formats.obj", "number_formats.obj, line 11, vertex 8: a vertex has no three finite coordinates"],
  ["PLY/points.ply", "points.ply has no faces: a cloud of points cannot be deformed"],
])("%s is refused: %s", (path, words) => {
  expect(all.find((sample) => sample.path === path)?.mesh).toContain(words);
});

it.each(opened.filter(([, { gltf }]) => gltf))(
  "%s has everything but its positions, normals and tangents as it came",
  async (_, mesh) => {
    const { gltf } = mesh as { gltf: Uint8Array };
    const document = (bytes: Uint8Array) => readGltfDocument("a.glb", bytes.slice(), new Map());
    expect(rewriteGlb({ ...mesh, gltf }, mesh.exact ?? mesh.positions)).toEqual(gltf);
    const out = rewriteGlb({ ...mesh, gltf }, bent(mesh));
    expect(lostIn(document(gltf), document(out))).toEqual([]);
    if (await isValid(gltf)) expect(await faultsOf(out)).toEqual([]);
    const again = parseMesh("a.glb", out);
    expect(again.faces).toEqual(mesh.faces);
    const wanted = bent(mesh);
    const size = wanted.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    expect(again.positions.findIndex((value, k) => !(Math.abs(value - wanted[k]!) < 1e-5 * size))).toBe(-1);
  },
);

it("most of those glTF are valid, so that their copies have to be", async () => {
  const valid = await Promise.all(opened.flatMap(([, { gltf }]) => (gltf ? [isValid(gltf)] : [])));
  expect(valid.filter(Boolean).length).toBeGreaterThan(valid.length / 2);
});

it.each(opened.filter(([, { obj }]) => obj))("%s has everything but the places of its vertices as it came", (_, mesh) => {
  const { obj } = mesh as { obj: Uint8Array };
  const out = rewriteObj({ ...mesh, obj }, bent(mesh));
  const lines = (bytes: Uint8Array) => {
    const text = new TextDecoder("latin1").decode(bytes).replace(/\\\r?\n/g, " ");
    return text.split("\n").filter((line) => !/^\s*(v|vn|f)\s/.test(line));
  };
  expect(lines(out)).toEqual(lines(obj));
  const again = parseMesh("a.obj", out);
  expect(again.faces).toEqual(mesh.faces);
  expect(again.exact ?? again.positions).toEqual(again.exact ? bent(mesh) : Float32Array.from(bent(mesh)));
});
