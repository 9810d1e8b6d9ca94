import { execFile } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { readGltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
import { parseMesh } from "lpdeform-client/mesh/read";
import { faultsOf } from "../gltf_validator.js";
import { columns, makeGlb, rows } from "../made_glb.js";
import { User } from "./user.js";

const program = join(import.meta.dirname, "../../../../../build/release/bin/lpdeform");
const row = (k: number) => Array.from({ length: columns + 1 }, (_, column) => k * (columns + 1) + column);
const handles = {
  handles: [
    { name: "base", vertices: row(0) },
    { name: "tip", vertices: row(rows), translate: [1, 0, 0.5] },
  ],
};

let folder: string;
let service: Service;
let user: User;

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), "lpdeform-gltf-"));
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse&encoding=float32`);
  await user.settled();
});

afterAll(async () => {
  await user.close();
  await service.stop();
  await rm(folder, { recursive: true });
});

it.each(["glb", "gltf"])("the command line writes .%s files that the Khronos validator has nothing against", async (ending) => {
  const at = (name: string) => join(folder, name);
  await writeFile(at("tube.glb"), makeGlb());
  await writeFile(at("tube.json"), JSON.stringify(handles));
  const options = ["--handles", at("tube.json"), "--free-components", "stay", "--normals", "--out", at(`bent.${ending}`)];
  await promisify(execFile)(program, ["deform", at("tube.glb"), ...options]);
  await promisify(execFile)(program, ["shape", "bar", "--out", at(`bar.${ending}`)]);
  const bent = new Uint8Array(await readFile(at(`bent.${ending}`)));
  expect(await faultsOf(bent)).toEqual([]);
  expect(await faultsOf(new Uint8Array(await readFile(at(`bar.${ending}`))))).toEqual([]);
  const [before, after] = [parseMesh("a.glb", makeGlb()).positions, parseMesh(`a.${ending}`, bent).positions];
  const far = row(rows).map((v) => after[3 * v]! - before[3 * v]!);
  for (const way of far) expect(way).toBeCloseTo(1, 5);
});

it("a GLB that is opened in the page, bent and saved has everything that it had", async () => {
  await user.openInstead({ name: "tube.glb", content: Buffer.from(makeGlb(true)) });
  await user.openFiles({ name: "tube.json", content: JSON.stringify(handles) });
  await user.handlesCame("tip");
  const saved = new Uint8Array(await user.save("Mesh as GLB"));
  expect(await faultsOf(saved)).toEqual([]);
  const [before, after] = [parseMesh("a.glb", makeGlb(true)), parseMesh("a.glb", saved)];
  expect(after.faces).toEqual(before.faces);
  for (const v of row(rows)) expect(after.positions[3 * v]! - before.positions[3 * v]!).toBeCloseTo(1, 5);
  for (let k = 0; k <= rows; ++k) {
    const [first, last] = [row(k)[0]!, row(k).at(-1)!];
    expect([...after.positions.slice(3 * first, 3 * first + 3)]).toEqual([...after.positions.slice(3 * last, 3 * last + 3)]);
  }
});

it("a GLB with lines and points is opened, and the page says which stay as they are", async () => {
  const document = readGltfDocument("tube.glb", makeGlb(true), new Map());
  const { primitives } = (document.json as any).meshes[0];
  const more = Array.from({ length: 5 }, (_, k) => ({ ...primitives[0], mode: k % 2 }));
  primitives.push(...more);
  await user.openFiles({ name: "tube.glb", content: Buffer.from(writeGlb(document)) });
  const stay = [1, 2, 3, 4, 5].map((k) => `The ${k % 2 ? "points" : "lines"} of primitive ${k} of mesh 0 stay as they are.`);
  await user.page
    .locator(".notice", { hasText: "5 parts of it stay as they are: the panel “Mesh” names them. Shown" })
    .waitFor();
  expect(await user.page.locator(".panel .still li").allTextContents()).toEqual(stay);
  primitives.length = 2;
  await user.openFiles({ name: "tube.glb", content: Buffer.from(writeGlb(document)) });
  await user.page.locator(".notice", { hasText: "A part of it stays as it is: the panel “Mesh” names it. Shown" }).waitFor();
  expect(await user.page.locator(".panel .still li").allTextContents()).toEqual(stay.slice(0, 1));
  document.json["extensionsRequired"] = ["KHR_draco_mesh_compression"];
  await user.openFiles({ name: "tube.glb", content: Buffer.from(writeGlb(document)) });
  const refused = "The extension “KHR_draco_mesh_compression” is required by the file and not known here.";
  await user.page.locator(".notice", { hasText: refused }).waitFor();
  expect(user.errors).toEqual([]);
});

it("the command line and the page refuse the same compressions that no primitive uses, in the same words", async () => {
  for (const name of ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"]) {
    const document = readGltfDocument("tube.glb", makeGlb(true), new Map());
    document.json["extensionsRequired"] = [name];
    const bytes = writeGlb(document);
    await writeFile(join(folder, "tube.glb"), bytes);
    const words = new RegExp(`he extension ["“]${name}["”] is required by the file and not known here`);
    expect(() => parseMesh("tube.glb", bytes)).toThrow(words);
    await expect(promisify(execFile)(program, ["info", join(folder, "tube.glb")])).rejects.toThrow(words);
  }
});

it("a glTF is opened together with the file that it names, and not without it", async () => {
  const { json, buffer } = readGltfDocument("tube.glb", makeGlb(), new Map());
  const buffers = [{ byteLength: buffer.length, uri: "tube%20data.bin" }];
  const gltf = { name: "tube.gltf", content: JSON.stringify({ ...json, buffers }) };
  const notice = (words: string) => user.page.locator(".notice", { hasText: words }).waitFor();
  await user.openFiles(gltf);
  await notice("Buffer 0 of tube.gltf is not in the file; open it together with the glTF");
  await user.openFiles({ name: "tube data.bin", content: Buffer.from(buffer) }, gltf);
  await notice(`tube.gltf: ${3 * (rows + 1) * (columns + 1)} vertices, ${3 * (rows + 1)} of them copies along seams, welded`);
  expect(user.errors).toEqual([]);
});
