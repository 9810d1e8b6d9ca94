import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import { Service } from "../../../client/test/real/service.js";
import { User } from "./user.js";

// Escape in the middle of a gesture: everything is as before it, here and on the server.

let service: Service;
let user: User;
let before: string;
let rest: number[];

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(() => service.stop());

const work = () => user.page.evaluate<string>("JSON.stringify(__lpdeform.document())");
const far = (a: readonly number[], b: readonly number[]) => Math.max(...a.map((value, k) => Math.abs(value - b[k]!)));

beforeEach(async () => {
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
  await user.page.locator('[data-handle="Top"] .name').click();
  await user.page.locator("canvas.stage").focus();
  [before, rest] = [await work(), await user.positions()];
});

afterEach(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
});

/** Something has moved, on the server as well. */
async function isMoved(): Promise<void> {
  await user.settled();
  expect(await work()).not.toBe(before);
  expect(far(await user.positions(), rest)).toBeGreaterThan(0.01);
}

async function isAsBefore(): Promise<void> {
  await user.settled();
  expect(await work()).toBe(before);
  // Frames of 16 bits, of an extent of 5 at most, and a result that is one to its tolerance.
  expect(far(await user.positions(), rest)).toBeLessThan(2e-3);
  expect(await user.ask("app.history.canUndo")).toBe(false);
  expect(await user.ask("app.view.now.selected")).toBe("Top");
}

/** Takes it there and pulls; `then` is done before it is let go. */
async function pull(from: { x: number; y: number }, then: () => Promise<void>): Promise<void> {
  const { mouse } = user.page;
  await mouse.move(from.x, from.y);
  await mouse.down();
  for (let step = 1; step <= 8; ++step) await mouse.move(from.x + 2 * step, from.y - 5 * step);
  await isMoved();
  await then();
  for (let step = 1; step <= 4; ++step) await mouse.move(from.x + 60, from.y + 10 * step); // the button is down yet
  await mouse.up();
  await isAsBefore();
}

const anchor = () => user.ask<{ x: number; y: number }>("anchorOnPage()");
const escape = () => user.page.keyboard.press("Escape");

it.each(["t", "r"])("a handle that the gizmo drags goes back (%s)", async (mode) => {
  await user.page.keyboard.press(mode);
  const { x, y } = await anchor();
  await pull(mode === "t" ? { x, y: y - 55 } : { x: x + 3, y: y - 6 }, escape);
  await pull(mode === "t" ? { x, y: y - 55 } : { x: x + 3, y: y - 6 }, escape); // it can be taken again
});

it("a handle that is dragged by its vertices goes back, and stays selected", async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await pull(await user.vertexOnPage(vertex!), escape);
});

it("a handle whose drag the browser ends goes back", async () => {
  await user.page.keyboard.press("t");
  const { x, y } = await anchor();
  await pull({ x, y: y - 55 }, () =>
    user.page.evaluate(
      "document.querySelector('canvas.stage').dispatchEvent(new PointerEvent('pointercancel', { pointerId: 1 }))",
    ),
  );
});

it("a handle that a key moves goes back while the key is held", async () => {
  const { keyboard } = user.page;
  await keyboard.down("Shift");
  for (let k = 0; k < 50; ++k) await keyboard.down("ArrowRight"); // it repeats
  await isMoved();
  await escape();
  await keyboard.up("ArrowRight");
  await keyboard.up("Shift");
  await isAsBefore();
});

it("p that a slider changes goes back", async () => {
  const slider = user.page.locator('.dock input[aria-label="p"]').first();
  const box = (await slider.boundingBox())!;
  const { mouse } = user.page;
  await mouse.move(box.x + 0.3 * box.width, box.y + box.height / 2);
  await mouse.down();
  await mouse.move(box.x + 0.8 * box.width, box.y + box.height / 2);
  expect(await work()).not.toBe(before);
  await escape();
  await mouse.up();
  await isAsBefore();
});
