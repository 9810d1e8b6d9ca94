import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withUser(bar, (one) => (user = one));

interface Facts {
  vertices: number[];
  pose: { translation: [number, number, number]; rotation: number[] };
}

const top = () => user.ask<Facts>("document().handles[1]");

async function hold(kind: string): Promise<void> {
  await user.page.locator('[data-handle="Top"] .name').click();
  await user.page.getByLabel("How it is held").selectOption(kind);
  await user.settled();
}

async function drag(): Promise<void> {
  await user.drag(await user.vertexOnPage((await top()).vertices[0]!), 50, 25);
  await user.settled();
}

it("a handle that is free along an axis goes along it by itself, and where it is dragged across it", async () => {
  await hold("axisLock");
  await drag();
  const { pose, vertices } = await top();
  expect(Math.hypot(pose.translation[0], pose.translation[1])).toBeGreaterThan(0.05);
  const rest = Object.values(await user.ask<Record<string, number>>("app.mesh.positions"));
  const places = await user.positions();
  const went = (axis: number) => vertices.map((vertex) => places[3 * vertex + axis]! - rest[3 * vertex + axis]!);
  for (const axis of [0, 1]) for (const by of went(axis)) expect(by).toBeCloseTo(pose.translation[axis]!, 2);
  expect(Math.max(...went(2).map((by) => Math.abs(by - pose.translation[2]!)))).toBeGreaterThan(1e-3);
});

it("one that is free in a plane goes where it is dragged across that plane alone", async () => {
  await user.page.keyboard.press("Control+z");
  await hold("planeLock");
  await user.page.getByLabel("Direction").selectOption("x");
  await drag();
  const { pose, vertices } = await top();
  const rest = Object.values(await user.ask<Record<string, number>>("app.mesh.positions"));
  const places = await user.positions();
  for (const vertex of vertices) {
    expect(places[3 * vertex]! - rest[3 * vertex]!).toBeCloseTo(pose.translation[0], 2);
  }
});

it("one that is held by its direction alone is turned, and says so to who drags it", async () => {
  await hold("orientation");
  expect(await user.ask("app.view.now.gizmo")).toBe("rotate");
  const before = (await top()).pose;
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("Escape"); // without the rings over it
  await drag();
  await user.page.locator(".notice", { hasText: "“Top” is held by its direction alone" }).waitFor();
  expect((await top()).pose).toEqual(before);
  await user.page.locator("canvas.stage").focus();
  const red = await user.ask<number>("app.red");
  for (let k = 0; k < 6; ++k) await user.page.keyboard.press("ArrowRight");
  await user.settled();
  expect((await top()).pose.translation).toEqual(before.translation);
  expect(await user.ask<number>("app.red")).not.toBe(red); // the foot is held exactly
});
