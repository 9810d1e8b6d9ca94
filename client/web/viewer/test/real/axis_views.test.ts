import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withUser(bar, (one) => (user = one));

/** Where the viewer is, as seen from what is looked at, of length 1. */
async function direction(pane = 0): Promise<number[]> {
  const { position, target } = await user.ask<{ position: number[]; target: number[] }>(`app.panes[${pane}].stage.look`);
  const away = position.map((value, axis) => value - target[axis]!);
  return away.map((value) => Math.round((1000 * value) / Math.hypot(...away)) / 1000 || 0);
}

it("B and the buttons look along the mesh's axes, in both pictures, with all of it in sight and the front below", async () => {
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("b");
  expect(await direction()).toEqual([0, -1, 0]);
  await user.page.keyboard.press("b");
  expect(await direction()).toEqual([1, 0, 0]);
  await user.page.keyboard.press("s");
  await user.settled(1);
  await user.page.getByRole("button", { name: "Top", exact: true }).click();
  expect([await direction(0), await direction(1)]).toEqual([
    [0, 0, 1],
    [0, 0, 1],
  ]);
  const [front, back] = [await user.vertexNear([0.5, 0, 5]), await user.vertexNear([0.5, 1, 5])];
  const [near, far] = [await user.vertexOnPage(front), await user.vertexOnPage(back)];
  expect(near.y).toBeGreaterThan(far.y + 20);
  expect(Math.abs(near.x - far.x)).toBeLessThan(2);
  await user.page.getByRole("button", { name: "Left", exact: true }).click();
  expect(await direction()).toEqual([-1, 0, 0]);
  const box = (await user.page.locator("canvas.stage").first().boundingBox())!;
  for (const height of [0, 5.25]) {
    const { y } = await user.vertexOnPage(await user.vertexNear([0, 0.5, height]));
    expect(y).toBeGreaterThan(box.y);
    expect(y).toBeLessThan(box.y + box.height);
  }
});

it("Q draws without perspective: what is pressed, drawn and dragged is where it is, however near", async () => {
  await user.ask("app.view.set({ isSplit: false })");
  await user.page.getByRole("button", { name: "Top", exact: true }).click();
  const corners = async () => {
    const at = await Promise.all([0, 5].map(async (z) => user.vertexOnPage(await user.vertexNear([0, 0, z]))));
    return Math.hypot(at[0]!.x - at[1]!.x, at[0]!.y - at[1]!.y);
  };
  expect(await corners()).toBeGreaterThan(10);
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("q");
  await user.until("window.__lpdeform.app.panes[0].stage.camera.isOrthographicCamera");
  expect(await corners()).toBeLessThan(0.3); // the view from the top leans by 1e-4, so that the front is below
  await user.page.keyboard.press("f");
  await user.ask("app.view.set({ selected: undefined })");
  const front = await user.vertexNear([0.5, 0, 2.6]);
  const at = await user.vertexOnPage(front);
  await user.page.mouse.click(at.x, at.y);
  const held = (await user.ask<{ vertices: number[] }[]>("document().handles")).at(-1)!;
  expect(held.vertices).toContain(front);
  await user.settled();
  await user.drag(at, -60, 0);
  await user.settled();
  const after = await user.vertexOnPage(front);
  expect(after.x - at.x).toBeCloseTo(-60, 0);
  expect(after.y - at.y).toBeCloseTo(0, 0);
  if (process.env["SHOT"]) await user.page.screenshot({ path: process.env["SHOT"] });
  // The wheel keeps what is under the pointer there, as far as the view can.
  await user.page.mouse.move(after.x, after.y);
  const heights = async () => (await user.vertexOnPage(await user.vertexNear([0.5, 0, 0]))).y;
  const before = await heights();
  await user.page.mouse.wheel(0, -300);
  await user.until(`Math.abs(window.__lpdeform.vertexOnPage(${await user.vertexNear([0.5, 0, 0])}).y - ${before}) > 20`);
  const near = await user.vertexOnPage(front);
  expect(Math.hypot(near.x - after.x, near.y - after.y)).toBeLessThan(8);
  await user.page.keyboard.press("q");
  await user.until("window.__lpdeform.app.panes[0].stage.camera.isPerspectiveCamera");
  await user.page.keyboard.press("Control+z");
  await user.page.keyboard.press("Control+z");
});

it("one click says that y is up, and the mesh is looked at from that top; another takes it back", async () => {
  await user.ask("app.view.set({ isSplit: false })");
  const up = user.page.locator(".panel label", { hasText: "Y is up" });
  for (const top of [
    [0, 1, 0],
    [0, 0, 1],
  ]) {
    await up.click();
    await user.page.getByRole("button", { name: "Top", exact: true }).click();
    expect(await direction()).toEqual(top);
  }
});
