import { readFileSync } from "node:fs";
import { join } from "node:path";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(() => service.stop());

beforeEach(async () => {
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
});

afterEach(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
});

const held = (one: User) =>
  one.page.evaluate<string>(
    "JSON.stringify(__lpdeform.document().handles.map(({ vertices, colour, isLocked }) => [vertices, colour, isLocked]))",
  );
const look = (one: User) => one.ask<{ position: number[] }>("app.panes[0].stage.look");

it("work is saved as a project by Ctrl+S, and opened in another browser with its shape, fields and camera", async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 90, 40);
  await user.ask("app.change({ ...window.__lpdeform.document(), p: 2.5 })");
  await user.page.keyboard.press("c");
  await user.page.keyboard.press("Control+ArrowLeft");
  await user.settled();
  const [shape, from, handles] = [await user.positions(), await look(user), await held(user)];
  const download = user.page.waitForEvent("download");
  await user.page.keyboard.press("Control+s");
  const file = await download;
  expect(file.suggestedFilename()).toBe("bar.lpdeform");
  const content = readFileSync(await file.path());
  await user.close();

  user = await User.open(`${service.url}/?shape=block&detail=coarse`);
  await user.settled();
  await user.page.keyboard.press("."); // work on another shape, which is set aside
  await user.openFiles({ name: "bent.lpdeform", content });
  await user.until("window.__lpdeform.app.mesh.name === 'bar'");
  await user.settled();
  expect(await user.page.locator(".notice").textContent()).toBe("bent.lpdeform: “bar” with 2 handles.");
  expect(await user.page.locator(".aside").textContent()).toContain("“block” was set aside");
  expect([await held(user), await user.ask("document().p"), await user.ask("app.view.now.colourBy")]).toEqual([
    handles,
    2.5,
    "p",
  ]);
  (await look(user)).position.forEach((value, axis) => expect(value).toBeCloseTo(from.position[axis]!, 6));
  // Both are results for the same convex problem, p being above 2; each is one to its tolerance, and is sent in 16 bits.
  (await user.positions()).forEach((value, k) => expect(Math.abs(value - shape[k]!)).toBeLessThan(0.02));

  await user.page.waitForTimeout(700);
  await user.page.reload();
  await user.settled();
  expect([await user.ask("app.mesh.name"), await held(user)]).toEqual(["bar", handles]); // kept like any work
});

it("a project that is damaged, foreign or not alone is refused with its reason, and nothing changes", async () => {
  await user.page.keyboard.press(".");
  const content = await user.save("Project, to go on with (Ctrl+S)");
  const before = await user.page.evaluate<string>("JSON.stringify(__lpdeform.document())");
  const notice = user.page.locator(".notice.bad");
  const cut = { name: "cut.lpdeform", content: content.subarray(0, content.length / 2) };
  const foreign = { name: "foreign.lpdeform", content: "OFF\n3 1 0\n" };
  await user.openFiles(cut);
  await notice.filter({ hasText: "cut.lpdeform is damaged or cut off" }).waitFor();
  await user.openFiles(foreign);
  await notice.filter({ hasText: "foreign.lpdeform is not a project of this page" }).waitFor();
  await user.openFiles({ name: "whole.lpdeform", content }, foreign);
  await notice.filter({ hasText: "A project is opened alone: whole.lpdeform is one of 2 files." }).waitFor();
  expect(await user.page.evaluate<string>("JSON.stringify(__lpdeform.document())")).toBe(before);
  expect(await user.ask("app.facts.now.setAside")).toEqual([]);
  expect(await user.ask("app.history.canUndo")).toBe(true);
});
