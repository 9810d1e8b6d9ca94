import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { writeObj } from "../../src/io/write_obj.js";
import { writeOff } from "../../src/io/write_off.js";
import { writePly } from "../../src/io/write_ply.js";
import { writeStl } from "../../src/io/write_stl.js";
import { blockSurface } from "../../src/model/block.js";
import { User } from "./user.js";

const mesh = blockSurface(2, 2, 6, () => true);
const vertexCount = mesh.positions.length / 3;

let folder: string;
let service: Service;
let user: User;

beforeAll(async () => {
  folder = mkdtempSync(join(tmpdir(), "lpdeform-drop-"));
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
});

afterAll(async () => {
  await user.close();
  await service.stop();
  rmSync(folder, { recursive: true, force: true });
});

async function drop(files: Record<string, string | Uint8Array>): Promise<void> {
  const paths = Object.entries(files).map(([name, content]) => {
    const path = join(folder, name);
    writeFileSync(path, content);
    return path;
  });
  await user.drop(...paths);
}

const isOpen = (name: string) => user.until(`window.__lpdeform.app.mesh.name === "${name}"`);
const refusal = (words: string) => user.page.locator(".notice.bad", { hasText: words }).waitFor();

it.each([
  ["tower.off", writeOff(mesh)],
  ["tower.obj", writeObj(mesh)],
  ["tower.ply", writePly(mesh, new Float32Array(vertexCount), 1)],
  ["Tower.STL", writeStl(mesh)],
])("%s that is dropped onto the page is there to be worked on", async (name, content) => {
  await drop({ [name]: content });
  await isOpen(name);
  await user.until('window.__lpdeform.status() === "live" && window.__lpdeform.app.facts.now.report');
  expect(await user.ask("app.facts.now.report.vertices")).toBe(vertexCount);
  expect(await user.ask("app.panes[0].stage.surface.mesh.name")).toBe(name);
});

it.each([
  [1280, 800],
  [1920, 1080],
  [1024, 600],
])("what is said of a mesh that was opened does not lie over it at %d x %d", async (width, height) => {
  await user.page.setViewportSize({ width, height });
  await user.ask(`app.view.set({ isPanelOpen: true })`);
  await user.ask(`app.openShape("bar", "coarse")`);
  await drop({ "tower.off": writeOff(mesh) });
  await isOpen("tower.off");
  await user.page.locator(".notice", { hasText: "tower.off" }).waitFor();
  const covered = await user.page.evaluate(() => {
    const places = Array.from({ length: (window as any).__lpdeform.app.mesh.positions.length / 3 }, (_, vertex) =>
      (window as any).__lpdeform.vertexOnPage(vertex),
    );
    const boxes = [...document.querySelectorAll(".notice, .aside")].map((one) => one.getBoundingClientRect());
    return places.filter(({ x, y }) => boxes.some((box) => x > box.left && x < box.right && y > box.top && y < box.bottom))
      .length;
  });
  expect(covered).toBe(0);
});

it("a mesh is dropped with its handles and what else lies beside it, in any order", async () => {
  const handles = JSON.stringify({
    handles: [
      { name: "Foot", vertices: [0, 1] },
      { name: "Top", vertices: [vertexCount - 1], translate: [0, 0, 1] },
    ],
  });
  await drop({ "all.json": handles, "all.mtl": "newmtl x", "all.obj": writeObj(mesh) });
  await isOpen("all.obj");
  await expect.poll(() => user.ask("document().handles.map(({ name }) => name)")).toEqual(["Foot", "Top"]);
  await user.settled();
  expect(await user.page.locator(".notice.bad").isHidden()).toBe(true);
});

it("a large file is told to be opened while it is", async () => {
  await user.page.evaluate(`{
    window.notices = [];
    window.__lpdeform.app.facts.watch(({ notice }) => [notice], ([notice]) => notice && window.notices.at(-1) !== notice.text && window.notices.push(notice.text));
  }`);
  await drop({ "large.off": `${writeOff(mesh)}#${"x".repeat(2e6)}` });
  await isOpen("large.off");
  const notices = await user.page.evaluate<string[]>("window.notices");
  expect(notices.slice(-2)).toEqual(["Opening large.off…", expect.stringContaining(`large.off: ${vertexCount} vertices.`)]);
  await user.page.getByRole("button", { name: "Bring it back" }).click(); // the handles that were there
  await isOpen("all.obj");
});

it("what cannot be opened is refused by name, and what is there stays", async () => {
  const before = await user.ask("document()");
  await drop({ "notes.txt": "hello" });
  await refusal("notes.txt is not a mesh that can be read: GLB, glTF, OFF, OBJ, PLY, STL, FBX, DAE and 3MF can.");
  await drop({ "a.off": writeOff(mesh), "b.obj": writeObj(mesh) });
  await refusal("One mesh at a time: a.off, b.obj are 2.");
  await drop({ "short.off": "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n" });
  await refusal("short.off, line 6, face 0: it says that it has 4 corners, and names 3.");
  await user.page.evaluate(() => {
    const file = new File([], "huge.stl"); // as if it were
    Object.defineProperty(file, "size", { value: 6e8 });
    const event = new DragEvent("drop", { cancelable: true });
    Object.defineProperty(event, "dataTransfer", { value: { files: [file] } });
    document.dispatchEvent(event);
  });
  await refusal("huge.stl has 600 MB; this page reads files of 500 MB at most.");
  expect(await user.ask("app.mesh.name")).toBe("all.obj");
  expect(await user.ask("document()")).toEqual(before);
  expect(user.errors).toEqual([]);
});

it("handles are not saved where there are none", async () => {
  await user.page.locator("canvas.stage").focus();
  while ((await user.ask<number>("document().handles.length")) > 0) {
    await user.page.keyboard.press("n");
    await user.page.keyboard.press("Delete");
  }
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Handles as JSON" }).click();
  await refusal("There are no handles to save");
});

it("an OBJ file keeps what it has beside where it is saved as such, and it is said where it is not", async () => {
  const [ring, top] = ["v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n", "v 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"];
  const beside = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\ng tower\nusemtl brick\n";
  const faces = ["1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"].map((face) =>
    face.split(" ").map((vertex, corner) => `${vertex}/${corner + 1}`),
  );
  await drop({ "chimney.obj": `${ring}${top}${beside}${faces.map((face) => `f ${face.join(" ")}\n`).join("")}` });
  await isOpen("chimney.obj");
  const handles = [
    { name: "Foot", vertices: [0, 1, 2, 3] },
    { name: "Top", vertices: [4, 5, 6, 7], translate: [0, 0, 2] },
  ];
  await drop({ "handles.json": JSON.stringify({ handles }) });
  await user.handlesCame("Top");
  const saved = (await user.save("Mesh as OBJ")).toString();
  expect(saved).toContain(beside);
  expect(saved).toContain(`f ${faces[0]!.join(" ")}\n`);
  expect(saved.split("\n")[4]).toBe("v 0 0 3");
  await user.save("Mesh as STL");
  const notice = user.page.locator(".notice", {
    hasText: "chimney-deformed.stl does not have what the original file also had",
  });
  await notice.waitFor();
  expect(await notice.textContent()).toContain(
    "texture coordinates, groups, materials, faces of more than three corners. Saved as OBJ, they stay.",
  );
});

it("a PLY is saved as PLY with its texture coordinates, and as another format it is said that they are gone", async () => {
  const corners = ["0 0 0 0 0", "1 0 0 1 0", "1 1 0 1 1", "0 1 0 0 1", "0 0 1 0 0", "1 0 1 1 0", "1 1 1 1 1", "0 1 1 0 1"];
  const faces = ["0 1 5 4", "1 2 6 5", "2 3 7 6", "3 0 4 7"].map((face) => `4 ${face}`);
  const head = ["x", "y", "z", "s", "t"].map((name) => `property float ${name}`);
  const list = `element face ${faces.length}\nproperty list uchar int vertex_indices\nend_header`;
  const file = ["ply\nformat ascii 1.0", `element vertex ${corners.length}`, ...head, list, ...corners, ...faces, ""];
  await drop({ "tower.ply": file.join("\n") });
  await isOpen("tower.ply");
  const handles = [
    { name: "Foot", vertices: [0, 1, 2, 3] },
    { name: "Top", vertices: [4, 5, 6, 7], translate: [0, 0, 2] },
  ];
  await drop({ "handles.json": JSON.stringify({ handles }) });
  await user.handlesCame("Top");
  const saved = (await user.save("Mesh as PLY, with distortion")).toString().split("\n");
  expect(saved.slice(3, 9)).toEqual([...head, "property float distortion"]);
  expect(saved.slice(11, 20).map((row) => row.split(" ").slice(0, 5).join(" "))).toEqual(
    [list.split("\n")[2], ...corners.map((row) => row.replace(/^(. .) 1/, "$1 3"))].slice(0, 9),
  );
  expect(saved.slice(20)).toEqual([...faces, ""]);
  await user.save("Mesh as OFF");
  const notice = user.page.locator(".notice", { hasText: "does not have what the original file also had" });
  await notice.waitFor();
  expect(await notice.textContent()).toContain("texture coordinates. Saved as PLY, they stay.");
});

/** An OBJ that takes long to open. */
function longObj(): string {
  const size = 300;
  const vertices = Array.from({ length: size * size }, (_, k) => `v ${k % size} ${Math.floor(k / size)} 0`);
  const faces = Array.from({ length: size * size - size }, (_, k) => k + 1).filter((k) => k % size !== 0);
  return `${vertices.join("\n")}\n${faces.map((k) => `f ${k} ${k + 1} ${k + size}`).join("\n")}\n`;
}

const dropInPage = `(name, text) => {
  const event = new DragEvent("drop", { dataTransfer: new DataTransfer(), bubbles: true });
  event.dataTransfer.items.add(new File([text], name));
  document.body.dispatchEvent(event);
}`;

it("handles that are dropped while a mesh is still being read are for that mesh, and its notice is there, not that of another", async () => {
  const handles = JSON.stringify({ handles: [{ name: "Corner", vertices: [89_999] }] });
  await user.page.evaluate(
    `(${dropInPage})("wide.obj", ${JSON.stringify(longObj())}); (${dropInPage})("wide.json", ${JSON.stringify(handles)})`,
  );
  await isOpen("wide.obj");
  await expect.poll(() => user.ask("document().handles.map(({ name }) => name)")).toEqual(["Corner"]);
  await expect.poll(() => user.page.locator(".notice").textContent()).toContain("wide.json: a handle.");
  await user.ask(`app.openShape("bar", "coarse")`);
  expect(await user.page.locator(".notice").isHidden()).toBe(true);
});

it("of two files the one that was opened last stays, however long the first one takes", async () => {
  await user.page.evaluate(`window.opened = [];
    window.__lpdeform.app.facts.watch(({ mesh }) => [mesh], ([{ name }]) => window.opened.push(name))`);
  await user.page.evaluate(
    `(${dropInPage})("long.obj", ${JSON.stringify(longObj())}); (${dropInPage})("short.off", ${JSON.stringify(writeOff(mesh))})`,
  );
  await isOpen("short.off");
  await user.page.waitForTimeout(4000);
  expect(await user.ask("app.mesh.name")).toBe("short.off");
  expect(await user.page.evaluate("window.opened")).not.toContain("long.obj");
});
