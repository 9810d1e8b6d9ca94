import { beforeAll, expect, it } from "vitest";
import { readOff } from "lpdeform-client/mesh/off";
import { writeOff } from "../../src/io/write_off.js";
import { splitTube } from "../split_tube.js";
import { withUser } from "./opened.js";
import type { User } from "./user.js";

const [columns, rows] = [16, 10];
const tube = splitTube(columns, rows);
const vertexCount = tube.positions.length / 3;
const ring = (row: number) => Array.from({ length: columns + 1 }, (_, column) => row * (columns + 1) + column);

let user: User;

withUser("/?shape=bar&detail=coarse&encoding=float32", (one) => (user = one));

beforeAll(async () => {
  await user.openInstead({ name: "tube.off", content: writeOff(tube) });
});

/** The largest distance of vertices that were in one place. */
async function gap(): Promise<number> {
  await user.settled();
  return gapOf(await user.positions());
}

function gapOf(positions: ArrayLike<number>): number {
  const far = (a: number, b: number) =>
    Math.hypot(...[0, 1, 2].map((axis) => positions[3 * a + axis]! - positions[3 * b + axis]!));
  return Math.max(...Array.from({ length: rows + 1 }, (_, row) => far(row * (columns + 1), row * (columns + 1) + columns)));
}

const notice = (words: string) => user.page.locator(".notice", { hasText: words }).waitFor();
const weldSwitch = () => user.page.locator(".seams .toggle");

it("a mesh with seams is opened as one surface, and says so", async () => {
  await notice(`${vertexCount} vertices, ${rows + 1} of them copies along seams, welded`);
  await user.until("window.__lpdeform.app.facts.now.report");
  expect(await user.ask("app.facts.now.report.weldedVertices")).toBe(rows + 1);
  expect(await user.ask("app.facts.now.report.notices")).toEqual([]);
});

it("a brush goes over a seam, and takes all that is in one place", async () => {
  await user.ask("app.view.set({ tool: 'paint', radius: 0.1 })");
  const { x, y } = await user.vertexOnPage(5 * (columns + 1));
  await user.drag({ x, y }, 3, 3);
  await expect.poll(() => user.ask("document().paintedP[5 * 17]")).toBe(1);
  const painted = await user.ask<Record<string, number>>("document().paintedP");
  for (let row = 0; row <= rows; ++row) {
    expect(painted[row * (columns + 1) + columns]).toEqual(painted[row * (columns + 1)]);
  }
  expect([painted[5 * (columns + 1) + 1], painted[5 * (columns + 1) + columns - 1]]).toEqual([1, 1]); // either side
  expect(await user.page.locator(".banner").isHidden()).toBe(true);
  await user.page.keyboard.press("Control+z");
});

it("handles and groups of a file name any of the copies, and the surface stays whole", async () => {
  const handles = [
    { name: "Base", vertices: ring(0) },
    { name: "Top", vertices: ring(rows), translate: [3, 1, -1], rotate: { axis: [0, 0, 1], angle_degrees: 100 } },
  ];
  // One of two copies: the other has the same p.
  const groups = [{ name: "g", vertices: [3 * (columns + 1)], p: 1 }];
  await user.openFiles({ name: "handles.json", content: JSON.stringify({ handles, groups }) });
  await user.until("window.__lpdeform.document().handles.length === 2");
  expect(await gap()).toBe(0);
  expect(await user.page.locator(".banner").isHidden()).toBe(true);
  expect(await user.ask("document().paintedP")).toMatchObject({ [3 * (columns + 1)]: 1, [3 * (columns + 1) + columns]: 1 });
});

it("what is saved has the file's own vertices and faces", async () => {
  const saved = readOff("saved.off", (await user.save("Mesh as OFF")).toString());
  expect([saved.positions.length, saved.faces]).toEqual([3 * vertexCount, tube.faces]);
  expect(gapOf(saved.exact ?? saved.positions)).toBe(0);
});

const openPanel = () =>
  user.page.locator(".panel details", { hasText: "Weld seams" }).evaluate((one: HTMLDetailsElement) => void (one.open = true));

it("the switch lets the surface tear, and closes it again", async () => {
  await openPanel();
  await weldSwitch().click();
  await notice("The mesh comes apart where it is split"); // as the server has it
  await user.page.locator('[data-warning="split_border_vertices"]').waitFor();
  expect(await gap()).toBeGreaterThan(0.1);
  expect(await user.ask("app.facts.now.report.weldedVertices")).toBe(0);
  await user.page.locator(".seams.torn", { hasText: "The surface tears there." }).waitFor();
  expect(await user.page.getByText("Nothing wrong with it.").isVisible()).toBe(false);
  await user.page.waitForTimeout(700);
  await user.page.reload(); // it is remembered with the work
  await user.until("window.__lpdeform?.app.facts.now.report && window.__lpdeform.status() === 'live'");
  expect(await gap()).toBeGreaterThan(0.1);
  await weldSwitch().click();
  await user.until("window.__lpdeform.app.facts.now.report?.weldedVertices > 0");
  expect(await gap()).toBe(0);
  expect(user.errors).toEqual([]);
});

it("how far apart welded vertices may be is said, and can be chosen; the choice stays with the work", async () => {
  const apart = { ...tube, positions: tube.positions.slice() };
  for (let row = 0; row <= rows; ++row) apart.positions[3 * (row * (columns + 1) + columns)]! += 0.005; // 0.05 % of the size
  await user.openFiles({ name: "apart.off", content: writeOff(apart) });
  await openPanel();
  await user.page.getByText("No vertices of its open borders lie on others.").waitFor();
  const within = user.page.getByLabel("How far apart welded vertices may be");
  expect(await within.inputValue()).toBe("0.000001");
  await within.selectOption("0.1 % of the size");
  await user.until(`window.__lpdeform.app.facts.now.report?.weldedVertices === ${rows + 1}`);
  await user.page.getByText(`${rows + 1} vertices lie on others`).waitFor();
  const { x, y } = await user.vertexOnPage(5 * (columns + 1) + 12);
  await user.page.mouse.click(x, y);
  await user.until("window.__lpdeform.document().handles.length === 1");
  await user.settled();
  await user.page.waitForTimeout(700);
  await user.page.reload();
  await user.until("window.__lpdeform?.app.facts.now.report && window.__lpdeform.status() === 'live'");
  expect(await user.ask("app.facts.now.report.weldedVertices")).toBe(rows + 1);
  expect(await within.inputValue()).toBe("0.001");
  await openPanel();
  await within.selectOption("in exactly one place");
  await user.until("window.__lpdeform.app.facts.now.report?.weldedVertices === 0");
  expect(user.errors).toEqual([]);
});

it("within a larger distance vertices inside of surfaces count, too, and are painted together", async () => {
  const inside = 5 * (columns + 1) + 1;
  const tip = [0, 1, 2].map((axis) => tube.positions[3 * inside + axis]!);
  const beside = [0, 1, 2].flatMap((way) => tip.map((value, axis) => value + (axis === way ? 0.05 : 0)));
  const at = (corner: number) => vertexCount + corner;
  const solid = [0, 1, 3, 1, 2, 3, 2, 0, 3, 0, 2, 1].map(at);
  const touched = {
    ...tube,
    positions: Float32Array.from([...tube.positions, ...tip, ...beside]),
    faces: Uint32Array.from([...tube.faces, ...solid]),
  };
  await user.openFiles({ name: "touched.off", content: writeOff(touched) });
  await user.until(`window.__lpdeform.app.facts.now.report?.weldedVertices === ${rows + 1}`); // on borders
  await openPanel();
  await user.page.getByLabel("How far apart welded vertices may be").selectOption("0.01 % of the size");
  await user.until(`window.__lpdeform.app.facts.now.report?.weldedVertices === ${rows + 2}`);
  await user.ask("app.view.set({ tool: 'paint', radius: 0.1 })");
  const { x, y } = await user.vertexOnPage(inside);
  await user.drag({ x: x - 5, y }, 2, 2); // it stands at the outline
  await expect.poll(() => user.ask(`document().paintedP[${inside}]`)).toBe(1);
  expect(await user.ask(`document().paintedP[${at(0)}]`)).toBe(1);
  await user.settled();
  expect(await user.page.locator(".banner").isHidden()).toBe(true);
  expect(user.errors).toEqual([]);
});

it("a distance that would join the ends of an edge is refused, and what was chosen before stays", async () => {
  const tiny = [0, 0, 20, 0.004, 0, 20, 0, 0.1, 20]; // an edge of 0.03 % of the size
  const positions = Float32Array.from([...tube.positions, ...tiny]);
  const faces = Uint32Array.from([...tube.faces, ...[0, 1, 2].map((corner) => vertexCount + corner)]);
  await user.openFiles({ name: "tiny.off", content: writeOff({ ...tube, positions, faces }) });
  await user.until(`window.__lpdeform.app.facts.now.report?.weldedVertices === ${rows + 1}`);
  await openPanel();
  const within = user.page.getByLabel("How far apart welded vertices may be");
  const refusal = user.page.locator(".notice.bad", { hasText: "% of the size: its ends would be one vertex." });
  await within.selectOption("0.1 % of the size");
  await refusal.waitFor();
  expect(await within.inputValue()).toBe("0.000001");
  expect(await user.ask("app.view.now.weldTolerance")).toBe(1e-6);
  expect(await user.ask("app.facts.now.report.weldedVertices")).toBe(rows + 1);
  await within.selectOption("0.01 % of the size"); // less than the edge
  await user.until("window.__lpdeform.app.view.now.weldTolerance === 1e-4");
  await user.ask("app.facts.set({ notice: undefined })");
  await user.ask("app.weld({ isOn: false, tolerance: 1e-3 })"); // no limit on the distance where nothing is welded
  expect(await user.ask("app.view.now.isWelded")).toBe(false);
  expect(await refusal.isHidden()).toBe(true);
  expect(user.errors).toEqual([]);
});

it("of two wishes for the welding the last one counts", async () => {
  const apart = { ...tube, positions: tube.positions.slice() };
  for (let row = 0; row <= rows; ++row) apart.positions[3 * (row * (columns + 1) + columns)]! += 0.005;
  await user.openFiles({ name: "twice.off", content: writeOff(apart) });
  await user.until("window.__lpdeform.app.mesh.name === 'twice.off'");
  const wishes = [1e-3, 1e-6].map((tolerance) => `window.__lpdeform.app.weld({ tolerance: ${tolerance}, isOn: true })`);
  await user.page.evaluate(`Promise.all([${wishes.join(", ")}])`);
  expect(await user.ask("app.view.now.weldTolerance")).toBe(1e-6);
  expect(await user.ask("app.seams?.copyCount ?? 0")).toBe(0);
});

it("a mesh without seams has no switch", async () => {
  await user.page.getByLabel("Shape").selectOption("bar");
  await user.settled();
  expect(await weldSwitch().isHidden()).toBe(true);
});

it("a mesh that would come apart, because its seams are not quite closed, says so, and can be welded", async () => {
  const positions = tube.positions.slice();
  for (let row = 0; row <= rows; ++row) positions[3 * (row * (columns + 1) + columns)]! += 1e-3;
  await user.openFiles({ name: "ajar.off", content: writeOff({ ...tube, positions }) });
  await notice(`Where ${2 * (rows + 1)} vertices of its borders lie near others it comes apart, unless “Weld within”`);
  await user.until("window.__lpdeform.app.facts.now.report");
  await user.page.locator("details.warned .seams.torn", { hasText: "it comes apart." }).waitFor();
  await user.page.getByLabel("How far apart welded vertices may be").selectOption("0.001");
  await user.until("window.__lpdeform.app.facts.now.seamVertices > 0 && window.__lpdeform.app.facts.now.looseVertices === 0");
  await user.until("window.__lpdeform.app.facts.now.report");
  expect(await user.page.locator("details.warned").count()).toBe(0);
});
