import { beforeEach, expect, it } from "vitest";
import type { Handle } from "../../src/model/document.js";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;
withNewUsers(bar, (one) => (user = one));

// The bar is 1 x 1 across x and y and 5.25 high; x = 0.5 is the plane.
beforeEach(() => user.page.getByLabel("Symmetry").selectOption("x"));

const handles = () => user.ask<Handle[]>("document().handles");
const settings = (view: object) => user.ask(`app.view.set(${JSON.stringify(view)})`);
/** x, y, z at rest of each of these vertices, x as seen from the plane. */
async function places(vertices: readonly number[]): Promise<string[]> {
  const rest = await user.ask<Record<number, number>>("app.mesh.positions");
  return vertices
    .map((v) => [Math.abs(rest[3 * v]! - 0.5), rest[3 * v + 1]!, rest[3 * v + 2]!].map((x) => x.toFixed(4)).join())
    .sort();
}

it("the brush makes two handles; dragging one drags the other, and the result is symmetric", async () => {
  await settings({ tool: "brush", radius: 0.04 });
  const from = await user.vertexOnPage(await user.vertexNear([0, 0, 2.6]));
  await user.drag(from, 0, 4);
  const [, , one, other] = await handles();
  expect(other).toBeDefined();
  expect(await places(one!.vertices)).toEqual(await places(other!.vertices));
  expect(one!.vertices.some((vertex) => other!.vertices.includes(vertex))).toBe(false);
  await settings({ tool: "move" });
  await user.settled();
  await user.drag(await user.vertexOnPage(one!.vertices[0]!), -60, 0);
  await user.settled();
  const [, , moved, image] = await handles();
  const [x, y, z] = moved!.pose.translation;
  expect(Math.hypot(x, y, z)).toBeGreaterThan(0.2);
  [-x, y, z].forEach((value, axis) => expect(image!.pose.translation[axis]).toBeCloseTo(value, 9));
  const positions = await user.positions();
  const [left, right] = [await user.vertexNear([0, 0, 3.2]), await user.vertexNear([1, 0, 3.2])];
  const at = (vertex: number) => positions.slice(3 * vertex, 3 * vertex + 3);
  expect(at(left)[0]! + at(right)[0]!).toBeCloseTo(1, 1);
  expect(at(left)[2]).toBeCloseTo(at(right)[2]!, 1);
  if (process.env["SHOT"]) await user.page.screenshot({ path: process.env["SHOT"] });
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("Delete");
  expect(await handles()).toHaveLength(2);
  await user.page.keyboard.press("Control+z");
  expect(await handles()).toHaveLength(4);
});

it("a stroke across the plane makes one handle, which is then kept on the plane", async () => {
  await settings({ tool: "brush", radius: 0.04 });
  const from = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.6]));
  await user.drag(from, 0, 4);
  const [, , one, other] = await handles();
  expect(other).toBeUndefined();
  await settings({ tool: "move" });
  await user.drag(await user.vertexOnPage(one!.vertices[0]!), -60, 20);
  const { translation } = (await handles())[2]!.pose;
  expect(translation[0]).toBe(0);
  expect(Math.hypot(...translation)).toBeGreaterThan(0.05);
});

it("a lasso and the p brush work on both sides; Y goes on to the other planes and to none", async () => {
  await settings({ tool: "paint", radius: 0.05, softness: 1 });
  await user.drag(await user.vertexOnPage(await user.vertexNear([0, 0, 2.6])), 0, 6);
  const painted = Object.values(await user.ask<Record<number, number>>("document().paintedP"));
  const rest = await user.ask<Record<number, number>>("app.mesh.positions");
  const found = painted.flatMap((value, v) =>
    Number.isNaN(value) || value === null ? [] : [[rest[3 * v]! - 0.5, v, value] as const],
  );
  const side = (sign: number) => found.filter(([x]) => sign * x > 1e-4);
  expect(side(1).length).toBeGreaterThan(2);
  expect(await places(side(1).map(([, v]) => v))).toEqual(await places(side(-1).map(([, v]) => v)));
  const sum = (sign: number) => side(sign).reduce((total, [, , value]) => total + value, 0);
  expect(sum(1)).toBeCloseTo(sum(-1), 4);

  await settings({ tool: "box" });
  const low = await user.vertexOnPage(await user.vertexNear([0, 0, 2.2]));
  await user.drag({ x: low.x - 30, y: low.y }, 45, -40);
  const [, , one, other] = await handles();
  expect(await places(one!.vertices)).toEqual(await places(other!.vertices));
  await user.page.locator("canvas.stage").focus();
  for (const symmetry of ["y", "z", "none"]) {
    await user.page.keyboard.press("y");
    expect(await user.ask("app.view.now.symmetry")).toBe(symmetry);
  }
  await user.until("!window.__lpdeform.app.panes[0].stage.plane.object.visible");
});
