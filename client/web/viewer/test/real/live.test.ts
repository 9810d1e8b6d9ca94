import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withUser(bar, (one) => (user = one));

/** Of some handle of the page's document. */
const handle = (name: string) => user.ask<{ vertices: number[] }>(`document().handles.find(({ name }) => name === "${name}")`);

it("follows a drag live, with colours that tell the distortion", async () => {
  const rest = await user.positions();
  const { cold } = await user.colours();
  expect(cold).toBeGreaterThan(0.6);

  const { vertices } = await handle("Top");
  const from = await user.vertexOnPage(vertices[0]!);
  await user.page.mouse.move(from.x, from.y);
  await user.page.mouse.down();
  await user.page.mouse.move(from.x + 60, from.y + 30);
  await user.page.mouse.move(from.x + 130, from.y + 60);
  // The button is still down: the surface follows before it is let go.
  await user.until("window.__lpdeform.app.red > 0");
  await user.page.mouse.up();
  await user.settled();

  const bent = await user.positions();
  const moved = bent.filter((value, k) => Math.abs(value - rest[k]!) > 0.01).length;
  expect(moved).toBeGreaterThan(rest.length / 4);
  expect(bent.every(Number.isFinite)).toBe(true);
  const distortion = await user.ask<number[]>("distortion()");
  expect(Math.max(...distortion)).toBeGreaterThan(0);
  const { warm } = await user.colours();
  expect(warm).toBeGreaterThan(0.05);
  await expect(user.page.locator(".legend-numbers").textContent()).resolves.toMatch(/≥/);
});

it("changes the surface with p", async () => {
  const before = await user.positions();
  await user.page.getByRole("button", { name: "6", exact: true }).click();
  await user.settled();
  const after = await user.positions();
  expect(Math.max(...after.map((value, k) => Math.abs(value - before[k]!)))).toBeGreaterThan(0.01);
  expect(await user.ask("document().p")).toBe(6);
});

it("holds nothing of second pictures that were closed", async () => {
  for (let time = 0; time < 3; ++time) {
    await user.page.keyboard.press("s");
    await user.settled(1);
    await user.page.locator("canvas.stage").nth(1).hover();
    await user.page.mouse.wheel(0, 10); // the other picture follows the one that was turned last
    await user.page.keyboard.press("s");
    await user.settled();
  }
  const devtools = await user.page.context().newCDPSession(user.page);
  const expression = "Object.getPrototypeOf(window.__lpdeform.app.panes[0].stage)";
  const { result } = await devtools.send("Runtime.evaluate", { expression });
  const stages = async () => {
    await devtools.send("HeapProfiler.collectGarbage"); // the collection of queryObjects alone now and then leaves garbage
    const { objects } = await devtools.send("Runtime.queryObjects", { prototypeObjectId: result.objectId! });
    const count = await devtools.send("Runtime.callFunctionOn", {
      functionDeclaration: "function () { return this.length; }",
      objectId: objects.objectId!,
    });
    await devtools.send("Runtime.releaseObject", { objectId: objects.objectId! }); // the list holds them, too
    return count.result.value as number;
  };
  // A session that is still being closed holds its picture.
  await expect.poll(stages, { timeout: 60_000 }).toBe(1);
  await devtools.detach();
});

it("offers a better shape by a button with what it saves, which goes with the next change", async () => {
  const take = user.page.getByRole("button", { name: "Take a shape with 7 % less energy" });
  await user.ask("app.facts.set({ better: [0.0714] })");
  await take.waitFor();
  await user.page.getByRole("button", { name: "2", exact: true }).click();
  await take.waitFor({ state: "hidden" });
  await user.settled();
});

it("places a handle where the surface is clicked, and takes it back", async () => {
  const count = await user.ask<number>("document().handles.length");
  const place = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.6]));
  await user.page.mouse.click(place.x, place.y);
  expect(await user.ask("document().handles.length")).toBe(count + 1);
  await user.settled();
  await user.page.keyboard.press("Control+z");
  expect(await user.ask("document().handles.length")).toBe(count);
  expect(user.errors).toEqual([]);
});

it.each(["1", "2", "6"])("is blue again once a change at p = %s is undone", async (p) => {
  await user.page.locator("canvas.stage").focus();
  while (await user.ask("app.history.canUndo")) await user.page.keyboard.press("Control+z");
  await user.ask("app.view.set({ selected: 'Top' })");
  await user.page.locator(".dock").getByRole("button", { name: p, exact: true }).click();
  await user.page.locator("canvas.stage").focus();
  for (let k = 0; k < 5; ++k) await user.page.keyboard.press("ArrowRight");
  await user.settled();
  expect(await user.ask("app.red")).toBeGreaterThan(0);
  for (let k = 0; k < 5; ++k) await user.page.keyboard.press("Control+z");
  await user.settled();
  expect(await user.ask("document().p")).toBe(Number(p));
  expect(await user.ask("app.red")).toBe(0);
  expect((await user.colours()).warm).toBe(0);
  expect(await user.page.locator(".legend").textContent()).toContain("none");
});
