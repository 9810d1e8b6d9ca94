import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
});

afterAll(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
  await service.stop();
});

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

it("a mesh whose y is up is looked at from its own top", async () => {
  await user.ask("app.view.set({ isYUp: true, isSplit: false })");
  await user.page.getByRole("button", { name: "Top", exact: true }).click();
  expect(await direction()).toEqual([0, 1, 0]);
});
