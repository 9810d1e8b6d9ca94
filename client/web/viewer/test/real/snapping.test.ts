import { beforeEach, expect, it } from "vitest";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers(bar, (one) => (user = one));

beforeEach(async () => {
  await user.page.locator('[data-handle="Top"] .name').click();
  await user.page.locator("canvas.stage").focus();
});

const snap = (to: string) => user.page.getByLabel("What a drag keeps to").selectOption(to);
const pose = () => user.ask<{ translation: number[]; rotation: number[]; center: number[] }>("document().handles[1].pose");
const anchor = () => user.ask<{ x: number; y: number }>("anchorOnPage(0)");
const step = 0.1; // of the bar, whose diagonal is 5.4

/** Whole multiples of the grid. */
function expectOnGrid(values: readonly number[]): void {
  for (const value of values) expect(value / step).toBeCloseTo(Math.round(value / step), 9);
}

it("on a grid, a drag of the surface, of an arrow and a key go by its steps, and rings by 15 degrees", async () => {
  await snap("grid");
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 57, 23);
  let { translation } = await pose();
  expect(Math.hypot(...translation)).toBeGreaterThan(step);
  expectOnGrid(translation);

  const before = translation;
  await user.drag({ x: (await anchor()).x, y: (await anchor()).y - 55 }, 0, -40);
  ({ translation } = await pose());
  expectOnGrid(translation);
  expect(translation.slice(0, 2)).toEqual(before.slice(0, 2));
  expect(translation[2]).toBeGreaterThan(before[2]!);

  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("ArrowRight");
  expect((await pose()).translation[0]).toBeCloseTo(before[0]! + step, 9);
  await user.page.keyboard.press("r");
  await user.page.keyboard.press("ArrowUp");
  const degrees = (2 * Math.acos((await pose()).rotation[3]!) * 180) / Math.PI;
  expect(degrees).toBeCloseTo(15, 9);
});

it("with vertices, the place that is dragged goes to a vertex of the original shape", async () => {
  await snap("vertices");
  const vertex = await user.vertexNear([0.25, 0, 5.25]);
  expect(await user.ask<number[]>("document().handles[1].vertices")).toContain(vertex);
  await user.page.keyboard.press("Escape"); // without a gizmo in the way
  const goal = await user.vertexNear([1, 0, 2.5]);
  const [from, to] = [await user.vertexOnPage(vertex!), await user.vertexOnPage(goal)];
  await user.drag({ x: from.x, y: from.y + 2 }, to.x - from.x + 5, to.y - from.y - 4);
  await user.settled();
  const rest = await user.ask<Record<string, number>>("app.mesh.positions");
  const { translation } = await pose();
  translation.forEach((value, axis) => {
    expect(Math.abs(rest[3 * vertex + axis]! + value - rest[3 * goal + axis]!)).toBeLessThan(1e-3); // frames of 16 bits
  });
});

it("the gizmo moves along the handle's axes, and along the picture's", async () => {
  await user.ask("app.view.set({ axes: 'local' })");
  const angle = Math.PI / 6;
  const turned = `{ rotation: [${Math.sin(angle / 2)}, 0, 0, ${Math.cos(angle / 2)}], translation: [0, 0, 0], center: one.pose.center }`;
  await user.page.evaluate(
    `window.__lpdeform.app.change({ ...window.__lpdeform.document(), handles: window.__lpdeform.document().handles.map((one) => one.name === "Top" ? { ...one, pose: ${turned} } : one) })`,
  );
  await user.settled();
  const { center } = await pose();
  const up = [center[0]!, center[1]! - 0.8 * Math.sin(angle), center[2]! + 0.8 * Math.cos(angle)]; // along its z
  const [at, tip] = [await anchor(), await user.ask<{ x: number; y: number }>(`pointOnPage(${JSON.stringify(up)})`)];
  const length = Math.hypot(tip.x - at.x, tip.y - at.y);
  const [dx, dy] = [(tip.x - at.x) / length, (tip.y - at.y) / length];
  await user.drag({ x: at.x + 55 * dx, y: at.y + 55 * dy }, 50 * dx, 50 * dy);
  const { translation, rotation } = await pose();
  expect(Math.hypot(...translation)).toBeGreaterThan(0.1);
  expect(translation[1]! / translation[2]!).toBeCloseTo(-Math.tan(angle), 6);
  expect(translation[0]).toBeCloseTo(0, 9);
  expect(rotation[0]).toBeCloseTo(Math.sin(angle / 2), 9);

  await user.page.keyboard.press("Control+z");
  await user.page.keyboard.press("x");
  expect(await user.ask("app.view.now.axes")).toBe("view");
  await user.settled();
  const place = await anchor();
  const before = (await pose()).translation;
  await user.drag({ x: place.x + 55, y: place.y }, 60, 0);
  const after = (await pose()).translation;
  const { position, target } = await user.ask<{ position: number[]; target: number[] }>("app.panes[0].stage.look");
  const [ax, ay] = [target[0]! - position[0]!, target[1]! - position[1]!]; // the picture's right lies across this, and level
  const by = after.map((value, axis) => value - before[axis]!);
  expect(Math.hypot(...by)).toBeGreaterThan(0.1);
  expect(Math.abs(by[2]!)).toBeLessThan(1e-6);
  expect(Math.abs(by[0]! * ax + by[1]! * ay)).toBeLessThan(1e-6);
});
