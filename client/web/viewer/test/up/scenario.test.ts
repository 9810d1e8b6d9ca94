import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { resultIn } from "../../../client/test/support/grpc_web.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { writeOff } from "../../src/io/write_off.js";
import { blockSurface } from "../../src/model/block.js";
import type { Mesh, Vector3 } from "lpdeform-client/mesh/mesh";
import { apply, type Pose } from "../../src/model/pose.js";
import { User } from "../real/user.js";
import { Up } from "./up.js";

let up: Up;
let user: User;

beforeAll(async () => {
  up = await Up.start();
  user = await User.open(up.url);
  await user.settled();
});

afterAll(async () => {
  await user?.close();
  await up?.stop();
});

/** 3 x 3 x 12 cells. */
const block = blockSurface(3, 3, 12, () => true);
const bottom = 0;
/** On its upper rim, to the front. */
const rim = block.positions.findIndex(
  (value, k) => k % 3 === 2 && value === 12 && block.positions[k - 1] === 0 && block.positions[k - 2] === 1,
);
const rimVertex = Math.floor(rim / 3);
/** Its coordinates are doubles that no float32 is. */
const exact = Float64Array.from(block.positions, (value) => 0.1 + 1.1 * value);
const tower: Mesh = { ...block, positions: Float32Array.from(exact), exact };
const towerFile = { name: "tower.off", content: writeOff({ positions: exact, faces: block.faces }) };

const heldNames = () => user.ask<string[]>("document().handles.map(({ name }) => name)");
const largestDifference = (a: readonly number[], b: readonly number[]) =>
  Math.max(...a.map((value, k) => Math.abs(value - b[k]!)));

async function boxAround(from: number, to: number, slack: number): Promise<void> {
  const [a, b] = [await user.vertexOnPage(from), await user.vertexOnPage(to)];
  const start = { x: Math.min(a.x, b.x) - 90, y: Math.min(a.y, b.y) - slack };
  await user.drag(start, Math.abs(a.x - b.x) + 180, Math.abs(a.y - b.y) + 2 * slack);
}

/** Of each vertex of a binary PLY as the page writes it: that many numbers from that property on. */
function fromPly(file: Buffer, first = 0, count = 3): number[] {
  const start = file.indexOf("end_header\n") + 11;
  const row = 4 * 8 + 3;
  return Array.from({ length: (count * exact.length) / 3 }, (_, k) =>
    file.readDoubleLE(start + row * Math.floor(k / count) + 8 * (first + (k % count))),
  );
}

/** Of each corner of each triangle. */
function fromStl(file: Buffer): number[] {
  return Array.from({ length: file.readUInt32LE(80) * 9 }, (_, k) =>
    file.readFloatLE(84 + 50 * Math.floor(k / 9) + 12 + 4 * (k % 9)),
  );
}

/** In the lines that begin like that. */
function numbersAfter(key: string, file: Buffer): number[] {
  const lines = file.toString().split("\n");
  return lines.filter((line) => line.startsWith(key)).flatMap((line) => line.slice(key.length).split(" ").map(Number));
}

describe("somebody with a mesh of their own", () => {
  let handles: Buffer;

  it("opens it and is told how it is", async () => {
    await user.openFiles(towerFile);
    await user.until("window.__lpdeform.app.facts.now.report !== undefined && window.__lpdeform.app.mesh.name === 'tower.off'");
    await user.page.locator("summary", { hasText: "Mesh" }).click();
    expect(await user.page.locator(".panel").textContent()).toMatch(/tower\.off: 164 vertices, 324 faces, 1 component, closed/);
    expect(await user.page.locator(".panel").textContent()).toContain("Nothing wrong with it.");
  });

  it("places handles with the box and by a click, undoes and redoes", async () => {
    await user.page.getByRole("button", { name: "Box", exact: true }).click();
    await boxAround(bottom, bottom, 30);
    expect((await heldNames()).length).toBe(1);
    await user.page.getByRole("button", { name: "Move", exact: true }).first().click();
    const place = await user.vertexOnPage(rimVertex);
    await user.page.mouse.click(place.x, place.y + 2);
    expect(await heldNames()).toEqual(["Handle 1", "Handle 2"]);
    await user.settled();
    await user.page.keyboard.press("Control+z");
    expect((await heldNames()).length).toBe(1);
    await user.page.keyboard.press("Control+Shift+Z");
    expect((await heldNames()).length).toBe(2);
    await user.settled();
  });

  it("drags, and the server dies and comes back in the middle of it: nothing is lost", async () => {
    const rest = await user.positions();
    const { mouse } = user.page;
    const from = await user.vertexOnPage(rimVertex);
    await mouse.move(from.x, from.y);
    await mouse.down();
    await mouse.move(from.x + 30, from.y + 10);
    await mouse.move(from.x + 60, from.y + 20);
    await user.until("window.__lpdeform.app.red > 0");

    await up.killServer();
    await user.until('window.__lpdeform.status() === "away"');
    await mouse.move(from.x + 80, from.y + 30); // the user goes on
    await user.page.locator(".banner", { hasText: "The server is away" }).waitFor();
    expect(await user.page.locator(".banner").textContent()).toContain("Your work is kept here");
    await up.startServer();
    await user.until('window.__lpdeform.status() === "live"');
    await mouse.move(from.x + 110, from.y + 40);
    await mouse.up();
    await user.settled();
    await user.page.locator(".banner").waitFor({ state: "hidden" });

    const bent = await user.positions();
    expect(largestDifference(bent, rest)).toBeGreaterThan(1);
    // The handle is exactly where it was dragged to, by the page's own account of it.
    const { vertices, pose } = await user.ask<{ vertices: number[]; pose: { translation: number[] } }>("document().handles[1]");
    const [vertex] = vertices as [number];
    pose.translation.forEach((value, axis) =>
      expect(bent[3 * vertex + axis]! - rest[3 * vertex + axis]!).toBeCloseTo(value, 2),
    );
    expect(user.errors).toEqual([]);
  });

  it("changes p and sees vertices move and colours change", async () => {
    const before = await user.positions();
    const colours = await user.colours();
    await user.page.getByRole("button", { name: "1", exact: true }).click();
    await user.settled();
    expect(largestDifference(await user.positions(), before)).toBeGreaterThan(0.05);
    const gathered = await user.colours();
    expect(Math.abs(gathered.warm - colours.warm) + Math.abs(gathered.cold - colours.cold)).toBeGreaterThan(0.02);
    await user.until("window.__lpdeform.frame().gap !== undefined"); // by itself, once all rests
  });

  it.each([
    ["PLY, with distortion", fromPly, (value: number) => value],
    ["OBJ", (file: Buffer) => numbersAfter("v ", file), (value: number) => value],
    ["OFF", (file: Buffer) => numbersAfter("", file).slice(4, 4 + exact.length), (value: number) => value],
    ["STL", fromStl, Math.fround],
  ] as const)("exports the mesh as %s with the numbers that the server sent", async (format, numbersOf, asWritten) => {
    const answer = user.page.waitForResponse((response) => response.url().endsWith("/Solve"));
    const file = await user.save(`Mesh as ${format}`);
    const { positions, distortion } = resultIn(await (await answer).body(), exact.length / 3);
    expect(await user.page.locator(".notice.bad").isHidden()).toBe(true);
    const at = (vertex: number) => [...positions.subarray(3 * vertex, 3 * vertex + 3)];
    if (format === "STL") expect(numbersOf(file)).toEqual([...tower.faces].flatMap(at).map(asWritten));
    else expect(numbersOf(file)).toEqual([...positions]);
    if (numbersOf === fromPly) expect(fromPly(file, 3, 1)).toEqual([...distortion]);
    expect(parseMesh(`x.${format.slice(0, 3).toLowerCase()}`, file).faces.length).toBe(tower.faces.length);

    // They are those of what is shown, and handles are where they were put, the one at rest to the last bit.
    expect(largestDifference([...positions], await user.positions())).toBeLessThan(0.02);
    const [foot, pulled] = await user.ask<{ vertices: number[]; pose: Pose }[]>("document().handles");
    const rest = (vertex: number) => [...exact.subarray(3 * vertex, 3 * vertex + 3)];
    for (const vertex of foot!.vertices) expect(at(vertex)).toEqual(rest(vertex));
    for (const vertex of pulled!.vertices) {
      expect(largestDifference(at(vertex), apply(pulled!.pose, rest(vertex) as unknown as Vector3))).toBeLessThan(1e-12);
    }
  });

  it("says that an export is under way until it is done", async () => {
    let release = () => {};
    const isReleased = new Promise<void>((resolve) => (release = resolve));
    await user.page.route("**/Solve", async (route) => {
      await isReleased;
      await route.continue();
    });
    const notice = user.page.locator(".notice", { hasText: "Exporting: computing the result in full precision…" });
    const saving = user.save("Mesh as OFF");
    await notice.waitFor();
    release();
    await saving;
    await notice.waitFor({ state: "hidden", timeout: 3000 }); // sooner than lines go that nothing ends
    await user.page.unroute("**/Solve");
  });

  it("saves the handles, reloads the exported mesh, and has both again", async () => {
    handles = await user.save("Handles as JSON");
    const exported = await user.save("Mesh as PLY, with distortion");
    const named = () => user.ask<object>("document().handles.map(({ name, vertices }) => ({ name, vertices }))");
    const before = await named();

    await user.openInstead(towerFile, { name: "tower-handles.json", content: handles });
    await expect.poll(named, { timeout: 10_000 }).toEqual(before);
    await user.settled();
    await user.until("window.__lpdeform.app.red > 0");
    expect(largestDifference(await user.positions(), [...tower.positions])).toBeGreaterThan(1);

    const numbers = fromPly(exported);
    // The numbers that the server sent go back to it to the last bit, and come back from it for what nothing holds.
    const bytes = Buffer.from(new Uint8Array(Float64Array.from(numbers).buffer));
    const upload = user.page.waitForRequest(
      (request) => request.url().endsWith("/CreateSession") && request.postDataBuffer()!.includes(bytes),
    );
    await user.openInstead({ name: "bent.ply", content: exported });
    expect(await user.ask("app.mesh.name")).toBe("bent.ply");
    await upload;
    await user.settled();
    expect(largestDifference(await user.positions(), numbers)).toBeLessThan(1e-3);
    expect(fromPly(await user.save("Mesh as PLY, with distortion"))).toEqual(numbers);
  });

  it("exports what is shown, and says so, where the server is away", async () => {
    await user.openInstead(towerFile, { name: "tower-handles.json", content: handles });
    await user.until("window.__lpdeform.document().handles.length === 2");
    await user.settled();
    await up.killServer();
    await user.until('window.__lpdeform.status() === "away"');
    const shown = await user.positions();
    const file = await user.save("Mesh as OFF");
    expect([...parseMesh("x.off", file).positions]).toEqual(shown);
    await user.page
      .locator(".notice.bad", { hasText: "What is shown was written as it is, rounded for the screen." })
      .waitFor();
    await up.startServer();
    await user.until('window.__lpdeform.status() === "live"');
    await user.settled();
  });

  it("saves a picture", async () => {
    const png = await user.save("Picture as PNG");
    expect(png.subarray(1, 4).toString()).toBe("PNG");
    expect(png.length).toBeGreaterThan(10_000);
    expect(user.errors).toEqual([]);
  });
});
