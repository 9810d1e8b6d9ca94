import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { readGltfDocument, writeGlb } from "lpdeform-client/mesh/gltf_document";
import { make3mf, makeDae, makeFbx } from "../made_foreign.js";
import { makeGlb } from "../made_glb.js";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

// Files as strangers have them, dropped onto the page: each is opened or refused by a sentence that names what is wrong with it, and
// what is refused changes nothing.

let user: User;
let folder: string;

withUser(bar, (one) => (user = one));
beforeAll(() => void (folder = mkdtempSync(join(tmpdir(), "lpdeform-odd-"))));
afterAll(() => rmSync(folder, { recursive: true }));

/** Drops the files, and returns what the page says then. Fails if it neither opens a mesh nor leaves all as it was. */
async function drop(files: Record<string, string | Uint8Array>): Promise<{ text: string; isOpen: boolean }> {
  const paths = Object.entries(files).map(([name, content]) => {
    writeFileSync(join(folder, name), content);
    return join(folder, name);
  });
  await user.page.evaluate(`(() => {
    const { app } = window.__lpdeform;
    app.facts.set({ notice: undefined });
    window.before = [app.mesh, app.document];
  })()`);
  await user.drop(...paths);
  await user.until(
    "(({ notice }) => notice && !notice.stays && !/overloaded/.test(notice.text))(window.__lpdeform.app.facts.now)",
  );
  const { text, isBad } = await user.ask<{ text: string; isBad: boolean }>("app.facts.now.notice");
  const isSame = await user.page.evaluate(
    "(({ mesh, document }) => window.before[0] === mesh && window.before[1] === document)(window.__lpdeform.app)",
  );
  expect(isSame).toBe(isBad);
  return { text, isOpen: !isBad };
}

const corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
const cube = `${corners}f 1 4 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n`;
const backwards = `${corners}f -8 -5 -6 -7\nf -4 -3 -2 -1\nf -8 -7 -3 -4\nf -7 -6 -2 -3\nf -6 -5 -1 -2\nf -5 -8 -4 -1\n`;
const glb = (change: (json: any) => void) => {
  const document = readGltfDocument("a.glb", makeGlb(), new Map());
  change(document.json);
  return writeGlb(document);
};
const { json, buffer } = readGltfDocument("a.glb", makeGlb(), new Map());
const gltf = (uri: string) => JSON.stringify({ ...json, buffers: [{ byteLength: buffer.length, uri }] });
const half = (bytes: string | Uint8Array) => bytes.slice(0, bytes.length / 2);

it.each<[string, Record<string, string | Uint8Array>]>([
  ["one triangle", { "one.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n" }],
  ["quads and triangles", { "mixed.obj": cube }],
  ["lines that end as in Windows", { "crlf.obj": cube.replaceAll("\n", "\r\n") }],
  ["a mark at its beginning", { "mark.obj": `\ufeff${cube}` }],
  ["names in Latin-1", { "latin.obj": Buffer.from(cube.replace("f", "g K\xf6rper\nf"), "latin1") }],
  ["corners that count backwards", { "negative.obj": backwards }],
  ["a name that looks like HTML", { "<img src=x onerror=alert(1)>.obj": cube }],
  ["a name with all kinds of signs", { "größe 100% #1?.obj": cube }],
  ["a face that names a vertex twice", { "repeat.obj": `${cube}f 1 1 2\n` }],
  ["each face twice", { "twice.obj": cube + cube.slice(corners.length) }],
  ["vertices that no face has", { "unused.obj": `v 9 9 9\n${cube.replace(/f .*/gs, backwards.slice(corners.length))}` }],
  ["its buffer as a data URI", { "data.gltf": gltf(`data:;base64,${Buffer.from(buffer).toString("base64")}`) }],
  ["its buffer beside it", { "beside.gltf": gltf("my%20data.bin"), "my data.bin": buffer }],
  [
    "several scenes",
    { "scenes.glb": glb((json) => Object.assign(json, { scenes: [{ nodes: [0] }, { nodes: [1] }], scene: 1 })) },
  ],
  ["no scene", { "none.glb": glb((json) => delete json.scenes) }],
  ["skins and morph targets", { "skin.glb": makeGlb() }],
  [
    "sparse positions",
    {
      "sparse.glb": glb(({ accessors }) => {
        const [indices, values] = [{ bufferView: 7, componentType: 5123 }, { bufferView: 0 }];
        accessors[0].sparse = { count: 1, indices, values };
      }),
    },
  ],
])("a file with %s is opened, and the server takes it", async (_, files) => {
  const [name] = Object.keys(files);
  expect(await drop(files)).toMatchObject({ isOpen: true, text: expect.stringContaining(`${name}: `) });
  await user.until("(({ status, report }) => status.kind === 'live' && report)(window.__lpdeform.app.facts.now)");
});

it.each<[Record<string, string | Uint8Array>, string]>([
  ...["obj", "off", "ply", "stl", "glb", "gltf", "fbx", "dae", "3mf", "json", "lpdeform"].map(
    (ending): [Record<string, string>, string] => [{ [`empty.${ending}`]: "" }, `empty.${ending} is empty.`],
  ),
  [{ "huge.obj": cube.replace("v 1 1 1", "v 1 1e30 1") }, "huge.obj, line 7, vertex 7: a vertex lies farther out than 10000"],
  [{ "infinite.obj": cube.replace("v 1 1 1", "v 1 1e999 1") }, "infinite.obj, line 7, vertex 7: a vertex has no three finite"],
  [{ "nan.obj": cube.replace("v 1 1 1", "v 1 nan 1") }, "nan.obj, line 7, vertex 7: a vertex has no three finite coordinates."],
  [{ "cloud.obj": corners }, "cloud.obj has no faces: a cloud of points cannot be deformed."],
  [{ "zero.obj": `${corners}f 0 1 2\n` }, "zero.obj, line 9: face 1 has the corner “0”; there are 8 vertices."],
  [{ "beyond.obj": `${corners}f 1 2 99\n` }, "beyond.obj, line 9: face 1 has the corner “99”; there are 8 vertices."],
  [{ "part.obj": `${corners}f 1 2 2.5\n` }, "part.obj, line 9: face 1 has the corner “2.5”; there are 8 vertices."],
  [{ "utf16.obj": Buffer.from(`\ufeff${cube}`, "utf16le") }, "utf16.obj is in UTF-16; save it as UTF-8."],
  [{ "cut.ply": half(`ply\nformat ascii 1.0\nelement vertex 9\nproperty int x\nend_header\n${"0\n".repeat(40)}`) }, "vertex 0"],
  [{ "missing.gltf": gltf("missing.bin") }, "Buffer 0 of missing.gltf is not in the file; open it together with the glTF"],
  [{ "short.gltf": gltf("a.bin"), "a.bin": buffer.slice(0, 100) }, "Buffer 0 of short.gltf has 100 bytes in place of"],
  [{ "percent.gltf": gltf("data:,%00%01") }, "Buffer 0 of percent.gltf is a data URI that is not in base64."],
  [{ "circle.glb": glb(({ nodes }) => (nodes[0].children = [0])) }, "Node 0 (“tube”) is reached twice"],
  [{ "cut.glb": half(makeGlb()) }, "cut.glb ends too soon: it has 13"],
  [{ "flat.glb": glb(({ nodes }) => nodes.forEach((node: any) => (node.scale = [1, 0, 1]))) }, "which its scale flattens."],
  [{ "cut.fbx": half(makeFbx()) }, "cut.fbx ends too soon: “Vertices: *612” of line 15 has no end."],
  [{ "text.fbx": "hello" }, "text.fbx cannot be read as FBX: Cannot find the version number for the file given."],
  [{ "cut.dae": half(makeDae()) }, "cut.dae ends too soon: <float_array> of line 12 has no end."],
  [
    { "cut.3mf": half(make3mf()) },
    "cut.3mf cannot be read as 3MF: the end of a ZIP file, where its parts are listed, is missing",
  ],
  [{ "list.json": "[1]" }, "list.json: In the handle file, the whole is not an object."],
  [{ "text.json": "hello" }, "text.json: The handle file is not JSON"],
  [{ "text.lpdeform": "hello" }, "text.lpdeform is not a project of this page."],
  [{ "photo.png": "\x89PNG" }, "photo.png is not a mesh that can be read: GLB, glTF"],
  [{ "a.obj": cube, "b.obj": cube }, "One mesh at a time: a.obj, b.obj are 2."],
])("of %o the page says why it is not opened: %s", async (files, words) => {
  expect(await drop(files)).toMatchObject({ isOpen: false, text: expect.stringContaining(words) });
});

it.each([
  ["without a size", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", /All 1 faces have zero area/],
  [
    "too small for the server's numbers",
    cube.replaceAll("1", "1e-30").replace(/f .*/gs, "f 1 2 3\n"),
    /diagonal is .*; it must be 1e-25/,
  ],
])("a mesh %s is shown, and the server's reason with it", async (_, obj, words) => {
  expect((await drop({ "refused.obj": obj })).isOpen).toBe(true);
  await user.page.locator(".banner", { hasText: words }).waitFor();
});
