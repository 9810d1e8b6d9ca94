import { readFileSync } from "node:fs";
import { join } from "node:path";
import { gunzipSync } from "node:zlib";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { ringObj, ringVertex } from "../support/ring.js";
import { User } from "./user.js";

// A mesh of more than 20,000 vertices: read and taken in workers, and ahead of the server's frames while a handle is dragged.

const [around, across] = [220, 100];
let service: Service;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(async () => {
  await service.stop();
});

const withoutWorkers = () => {
  window.Worker = class {
    constructor() {
      throw new DOMException("no workers here", "SecurityError");
    }
  } as unknown as typeof Worker;
};

/** Opens the ring and puts handles at 0.62 and 0.88 of the turn around it. Returns where a vertex of it is on the page. */
async function openRing(user: User) {
  await user.settled();
  await user.openFiles({ name: "ring.obj", content: ringObj(around, across) });
  await user.until(`window.__lpdeform.app.mesh.name === "ring.obj"`);
  const onRing = (turn: number) => user.vertexOnPage(ringVertex(around, across, turn, 0.2));
  for (const turn of [0.62, 0.88]) {
    const { x, y } = await onRing(turn);
    await user.page.mouse.click(x, y);
  }
  await user.settled();
  return onRing;
}

/** So that a test can end them. */
const withKeptWorkers = () => {
  const kept: Worker[] = [];
  const Own = window.Worker;
  window.Worker = class extends Own {
    constructor(url: string | URL, options?: WorkerOptions) {
      super(url, options);
      kept.push(this);
    }
  };
  Object.assign(window, { kept });
};

it("goes on when the mesh's worker ends", async () => {
  const user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  await user.page.evaluate(withKeptWorkers);
  const onRing = await openRing(user);
  await user.page.evaluate("window.kept.forEach((one) => { one.terminate(); one.dispatchEvent(new Event('error')); })");
  await expect.poll(() => user.page.workers().length).toBe(0);
  const [from, far] = await Promise.all([onRing(0.88), onRing(0.8)]);
  await user.drag(from, 60, -30);
  await user.settled();
  const [after, followed] = await Promise.all([onRing(0.88), onRing(0.8)]);
  expect(Math.hypot(after.x - from.x - 60, after.y - from.y + 30)).toBeLessThan(2);
  expect(Math.hypot(followed.x - far.x, followed.y - far.y)).toBeGreaterThan(1);
  expect(await user.ask("status()")).toBe("live");
  expect(user.errors).toEqual([]);
  await user.close();
});

it.each([true, false])("follows a handle between frames; with workers: %s", async (hasWorkers) => {
  const user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  if (!hasWorkers) await user.page.evaluate(withoutWorkers);
  const onRing = await openRing(user);
  const workers = user.page.workers().map((worker) => /\/(\w+)_worker/.exec(worker.url())![1]);
  expect(workers.sort()).toEqual(hasWorkers ? ["mesh"] : []); // it has read the file, too
  const [from, far] = await Promise.all([onRing(0.88), onRing(0.4)]);

  // No frame is taken: what moves is ahead of them.
  await user.ask("app.panes[0].takeFrame = () => false");
  const { mouse } = user.page;
  await mouse.move(from.x, from.y);
  await mouse.down();
  for (let step = 1; step <= 10; ++step) await mouse.move(from.x + 6 * step, from.y - 3 * step);
  const vertex = ringVertex(around, across, 0.88, 0.2);
  const at = `window.__lpdeform.vertexOnPage(${vertex})`;
  await user.until(`Math.hypot(${at}.x - ${from.x + 60}, ${at}.y - ${from.y - 30}) < 2`);
  // As long as frames are due it is not drawn finely, which a picture at rest is half a second later.
  await new Promise((later) => setTimeout(later, 1000));
  const ratio = `(({ width, clientWidth }) => width / clientWidth)(window.__lpdeform.app.panes[0].stage.canvas)`;
  expect(await user.page.evaluate(ratio)).toBeLessThanOrEqual(1);
  const other = await onRing(0.4);
  expect(Math.hypot(other.x - far.x, other.y - far.y)).toBeGreaterThan(1); // goes along a little
  expect(Math.hypot(other.x - far.x, other.y - far.y)).toBeLessThan(40);
  const fixed = await onRing(0.62);

  // Frames correct it, and what is held stays where it is in both.
  await user.page.evaluate("delete window.__lpdeform.app.panes[0].takeFrame");
  await mouse.up();
  await user.settled();
  await user.until(`${ratio} === 2`);
  const [after, still] = await Promise.all([onRing(0.88), onRing(0.62)]);
  expect(Math.hypot(after.x - from.x - 60, after.y - from.y + 30)).toBeLessThan(2);
  expect(Math.hypot(still.x - fixed.x, still.y - fixed.y)).toBeLessThan(1);
  expect(await user.ask("app.panes[0].stage.surface.ahead.value.toArray()")).toEqual([
    ...[1, 0, 0, 0],
    ...[0, 1, 0, 0],
    ...[0, 0, 1, 0],
    ...[0, 0, 0, 1],
  ]);
  expect(user.errors).toEqual([]);
  await user.close();
});

it("comes back after a reload as one block of bytes, with its handle and the file that it came from", async () => {
  const user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  await user.settled();
  await user.openFiles({ name: "ring.obj", content: ringObj(around, across) });
  await user.until(`window.__lpdeform.app.mesh.name === "ring.obj"`);
  const { x, y } = await user.vertexOnPage(ringVertex(around, across, 0.62, 0.2));
  await user.page.mouse.click(x, y);
  const kept = `(async () => {
    const database = await new Promise((done) => {
      const request = indexedDB.open("lpdeform");
      request.onsuccess = () => done(request.result);
    });
    const all = database.transaction("meshes").objectStore("meshes").getAll();
    await new Promise((done) => (all.onsuccess = done));
    return all.result.map((mesh) => mesh.blob?.size ?? 0);
  })()`;
  await expect.poll(() => user.page.evaluate(kept)).toHaveLength(1);
  const [size] = (await user.page.evaluate(kept)) as number[];
  expect(size).toBeGreaterThan(12 * 3 * around * across);
  const before = await user.page.evaluate(`[...window.__lpdeform.app.mesh.positions.subarray(0, 300)]`);
  await user.page.reload();
  await user.until(`window.__lpdeform?.app.mesh.name === "ring.obj"`);
  expect(await user.page.evaluate(`[...window.__lpdeform.app.mesh.positions.subarray(0, 300)]`)).toEqual(before);
  expect(await user.ask<number>("app.document.handles.length")).toBe(1);
  expect(await user.ask<number>("app.mesh.obj.length")).toBe(ringObj(around, across).length);
  await user.settled();
  expect(user.errors).toEqual([]);
  await user.close();
});

it("names what is wrong with a large file that a worker reads", async () => {
  const user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  await user.settled();
  await user.openFiles({ name: "ring.obj", content: `${ringObj(around, across)}f 1 2 99999\n` });
  await user.page.getByText(`face ${2 * around * across + 1} has the corner “99999”`).waitFor();
  expect(user.errors).toEqual([]);
  await user.close();
});

it("has all of a stroke of the p brush in a project that is saved in the middle of it, and in work that is set aside for a mesh", async () => {
  const user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  const onRing = await openRing(user);
  await user.page.keyboard.press("e");
  await user.ask("app.view.set({ radius: 0.02 })");
  const painted = "[...(window.__lpdeform.document().paintedP ?? [])].filter((value) => !Number.isNaN(value)).length";
  /** Moves the pointer, and does something else before the place is painted. Returns how many vertices are painted by then. */
  const moveAnd = (to: { x: number; y: number }, act: string) =>
    user.page.evaluate<number>(`(() => {
      const at = { clientX: ${to.x}, clientY: ${to.y}, pointerId: 1, buttons: 1, bubbles: true };
      document.querySelector("canvas.stage").dispatchEvent(new PointerEvent("pointermove", at));
      const before = ${painted};
      ${act};
      return before;
    })()`);
  const [from, to, next] = await Promise.all([onRing(0.74), onRing(0.76), onRing(0.78)]);
  await user.page.mouse.move(from.x, from.y);
  await user.page.mouse.down();
  await user.until(`${painted} > 0`);
  const first = await user.page.evaluate<number>(painted);
  const download = user.page.waitForEvent("download");
  const save = `document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "s", ctrlKey: true, bubbles: true }))`;
  expect(await moveAnd(to, save)).toBe(first);
  const line = gunzipSync(readFileSync(await (await download).path()))
    .toString("latin1")
    .split("\n", 1)[0]!;
  const { groups } = JSON.parse(line).handles as { groups: { vertices: number[] }[] };
  const saved = groups.reduce((sum, { vertices }) => sum + vertices.length, 0);
  expect(saved).toBeGreaterThan(first);
  expect(saved).toBe(await user.page.evaluate(painted));

  expect(await moveAnd(next, `window.__lpdeform.app.openShape("bar", "coarse")`)).toBe(saved);
  await user.page.mouse.up();
  await user.settled();
  expect(await user.page.evaluate(painted)).toBe(0);
  await user.page.getByRole("button", { name: "Bring it back" }).click();
  await user.until(`window.__lpdeform.app.mesh.name === "ring.obj"`);
  expect(await user.page.evaluate(painted)).toBeGreaterThan(saved);
  expect(user.errors).toEqual([]);
  await user.close();
});
