import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

// Escape in the middle of a gesture: everything is as before it, here and on the server.

let service: Service;
let user: User;
let before: string;
let rest: number[];
/** There are two pictures, and what is asked of the server is asked of both. */
let isSplit: boolean;

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
  isSplit = false;
  [before, rest] = [await work(), await user.positions()];
});

afterEach(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
});

async function settled(): Promise<void> {
  await user.settled();
  if (isSplit) await user.settled(1);
}

/** Two pictures; what is done next is done in the second. */
async function split(): Promise<void> {
  await user.page.keyboard.press("s");
  isSplit = true;
  await settled();
  await user.page.locator("canvas.stage").nth(1).focus();
}

/** Something has moved, on the server as well. */
async function isMoved(): Promise<void> {
  await settled();
  expect(await work()).not.toBe(before);
  expect(far(await user.positions(), rest)).toBeGreaterThan(0.01);
}

async function isAsBefore(): Promise<void> {
  await settled();
  expect(await work()).toBe(before);
  // Frames of 16 bits, of an extent of 5 at most, and a result that is one to its tolerance.
  expect(far(await user.positions(), rest)).toBeLessThan(2e-3);
  if (isSplit) expect(far(await user.positions(1), rest)).toBeLessThan(2e-3);
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

const anchor = (pane = 0) => user.ask<{ x: number; y: number }>(`anchorOnPage(${pane})`);
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

it.each(["t", "r"])("undo takes back a drag that goes on, and ends it (%s)", async (mode) => {
  const undo = () => user.page.keyboard.press("Control+z");
  await user.page.keyboard.press(mode);
  const { x, y } = await anchor();
  await pull(mode === "t" ? { x, y: y - 55 } : { x: x + 3, y: y - 6 }, undo);
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await pull(await user.vertexOnPage(vertex!), undo);
});

it("undo takes back a stroke of the p brush that goes on, and ends it", async () => {
  const { keyboard, mouse } = user.page;
  await keyboard.press("e");
  const { x, y } = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.5]));
  await mouse.move(x, y);
  await mouse.down();
  await mouse.move(x + 2, y + 30, { steps: 3 });
  expect(await work()).not.toBe(before);
  await keyboard.press("Control+z");
  await mouse.move(x + 4, y + 50, { steps: 3 });
  await mouse.up();
  expect(await work()).toBe(before);
  await keyboard.press("Control+Shift+z");
  expect(await work()).not.toBe(before);
});

describe("in the second of two pictures", () => {
  beforeEach(split);

  it.each(["t", "r"])("a handle that the gizmo drags goes back (%s)", async (mode) => {
    await user.page.keyboard.press(mode);
    const { x, y } = await anchor(1);
    const from = mode === "t" ? { x, y: y - 55 } : { x: x + 3, y: y - 6 };
    await pull(from, escape);
    await pull(from, escape); // it can be taken again
  });

  it("a handle that is dragged by its vertices goes back, and stays selected", async () => {
    const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
    await pull(await user.vertexOnPage(vertex!, 1), escape);
  });

  it("a drag whose picture is closed is a step, and can be undone", async () => {
    const { keyboard, mouse } = user.page;
    await keyboard.press("t");
    const { x, y } = await anchor(1);
    await mouse.move(x, y - 55);
    await mouse.down();
    await mouse.move(x + 16, y - 95, { steps: 8 });
    await isMoved();
    await keyboard.press("s");
    isSplit = false;
    await escape(); // there is nothing under way
    await isMoved();
    await mouse.up();
    await keyboard.press("Control+z");
    await keyboard.press("n");
    await keyboard.press("n"); // Escape has cleared the selection
    await isAsBefore();
  });

  it("what the brush has painted is dropped, and the selection stays", async () => {
    const { keyboard, mouse } = user.page;
    await keyboard.press("2");
    const from = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2]), 1);
    await mouse.move(from.x, from.y);
    await mouse.down();
    await mouse.move(from.x, from.y - 30, { steps: 5 });
    expect(await user.ask("app.facts.now.pointedOut.vertices.length")).toBeGreaterThan(0);
    await escape();
    expect(await user.ask("app.facts.now.pointedOut.vertices.length")).toBe(0);
    await mouse.up();
    await isAsBefore();
  });
});

it("a drag whose mesh makes room for another leaves that one alone", async () => {
  await user.page.keyboard.press("t");
  const { x, y } = await anchor();
  const { mouse } = user.page;
  await mouse.move(x, y - 55);
  await mouse.down();
  await mouse.move(x + 16, y - 95, { steps: 8 });
  expect(await work()).not.toBe(before);
  await user.page.evaluate('__lpdeform.app.openShape("bar", "coarse")'); // as by a file that was slow to read
  await mouse.move(x + 60, y, { steps: 4 });
  await mouse.up();
  await isAsBefore();
  expect(await user.ask("app.facts.now.setAside.length")).toBe(1); // with what the drag has done
});

it("a press that Escape or another mesh comes upon places no handle", async () => {
  const place = await user.vertexOnPage(0);
  const { mouse, keyboard } = user.page;
  for (const between of [
    () => keyboard.press("Escape"),
    () => user.page.evaluate('__lpdeform.app.openShape("bar", "coarse")'),
  ]) {
    await user.ask(`app.view.set({ selected: undefined, tool: "move" })`);
    await mouse.move(place.x, place.y);
    await mouse.down();
    await between();
    const count = await user.ask<number>("document().handles.length");
    await mouse.up();
    expect(await user.ask("document().handles.length")).toBe(count);
    expect(await user.ask("app.history.canUndo")).toBe(false);
  }
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
