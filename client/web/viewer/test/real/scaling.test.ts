import { beforeEach, expect, it } from "vitest";
import type { Handle } from "../../src/model/document.js";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;
withNewUsers(bar, (one) => (user = one));
beforeEach(() => user.page.locator('[data-handle="Top"] .name').click());

const top = async () => (await user.ask<Handle[]>("document().handles"))[1]!;
const press = (key: string) => user.page.keyboard.press(key);

/** How wide what the handle holds is along each axis, as the server has solved it. */
async function extents(): Promise<number[]> {
  await user.settled();
  const positions = await user.positions();
  const { vertices } = await top();
  return [0, 1, 2].map((axis) => {
    const values = vertices.map((vertex) => positions[3 * vertex + axis]!);
    return Math.max(...values) - Math.min(...values);
  });
}

it("the cubes of the gizmo scale what a handle holds; Escape reverts it, and undo takes it back", async () => {
  const [x, y] = await extents();
  await user.page.locator("canvas.stage").focus();
  await press("z");
  await user.until("window.__lpdeform.app.panes[0].stage.gizmo.object.children.length > 0");
  const axes = await user.ask("app.view.now.axes");
  await press("x");
  await user.page.locator(".notice", { hasText: "Cubes have the handle’s axes." }).waitFor();
  expect(await user.ask("app.view.now.axes")).toBe(axes);
  const at = await user.ask<{ x: number; y: number }>("anchorOnPage()");
  await user.drag(at, 60, -60);
  const { scale } = (await top()).pose;
  expect(scale![0]).toBeCloseTo(Math.exp(120 / 200), 6);
  expect(scale![0]).toBeCloseTo(scale![1], 9);
  const [wide, deep] = await extents();
  expect(wide! / x!).toBeCloseTo(scale![0], 2);
  expect(deep! / y!).toBeCloseTo(scale![1], 2);
  if (process.env["SHOT"]) await user.page.screenshot({ path: process.env["SHOT"] });
  await user.page.locator("canvas.stage").focus();
  await press("Control+z");
  expect((await top()).pose.scale).toBeUndefined();
  await user.page.mouse.move(at.x, at.y);
  await user.page.mouse.down();
  await user.page.mouse.move(at.x + 50, at.y - 50, { steps: 4 });
  expect((await top()).pose.scale).toBeDefined();
  await press("Escape");
  await user.page.mouse.up();
  expect((await top()).pose.scale).toBeUndefined();
});

it("numbers, arrow keys and steps scale; what cannot be is refused; a project keeps it", async () => {
  const field = user.page.getByLabel("Scaled along x");
  await field.fill("2");
  await field.press("Enter");
  const [x, y, z] = await extents();
  expect([x, y]).toEqual([expect.closeTo(2, 2), expect.closeTo(1, 2)]);
  expect(z).toBeLessThan(0.3);
  await field.fill("0");
  await field.press("Enter");
  await user.page.locator(".notice.bad", { hasText: "0.01" }).waitFor();
  expect((await top()).pose.scale).toEqual([2, 1, 1]);
  await user.page.locator("canvas.stage").focus();
  await press("z");
  await press("ArrowUp");
  expect((await top()).pose.scale).toEqual([2, 1.05, 1]);
  await press("m");
  await press("ArrowLeft");
  expect((await top()).pose.scale![0]).toBeCloseTo(1.9, 9);
  const project = await user.save("Project, to go on with (Ctrl+S)");
  await user.page.getByRole("button", { name: "Back to rest" }).click();
  expect((await top()).pose.scale).toBeUndefined();
  await user.openFiles({ name: "a.lpdeform", content: project });
  await user.until("window.__lpdeform.document().handles[1].pose.scale !== undefined");
  expect((await extents())[0]).toBeCloseTo(1.9, 2);
  await user.page.getByLabel("How it is held").selectOption("orientation");
  await user.until(`document.querySelector('[aria-label="Scaled along x"]').disabled`);
  await user.settled();
  expect(await user.ask("app.facts.now.problem")).toBeUndefined();
});
