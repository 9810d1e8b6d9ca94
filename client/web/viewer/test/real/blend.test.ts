import { beforeEach, expect, it } from "vitest";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers(bar, (one) => (user = one));

beforeEach(async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 120, 60);
  await user.settled();
});

const status = () => user.page.locator(".blend .readiness");
const blend = () => user.page.getByRole("slider", { name: "Blend p" });
const allReady = () => status().filter({ hasText: "All shapes are ready." }).waitFor({ timeout: 60_000 });
const fewReady = () =>
  status()
    .filter({ hasText: /^\d+ of 12 shapes are ready/ })
    .waitFor();
/** The number of the newest change that the work's own session was asked for. */
const sent = () => user.ask<number>("app.panes[0].live.newestInput");
const shown = () => user.page.evaluate<number[]>("[...window.__lpdeform.app.panes[0].stage.surface.positions]");
const far = (a: readonly number[], b: readonly number[]) => Math.max(...a.map((value, k) => Math.abs(value - b[k]!)));

it("with nothing pressed, a slider passes through prepared shapes without a solve, says which are interpolated, and is solved when it is let go", async () => {
  expect(await blend().isVisible()).toBe(true);
  await allReady();
  const [before, asked] = [await shown(), await sent()];
  const said = user.page.locator(".blend [role=status]");
  const move = (p: number) =>
    blend().evaluate(
      (input: HTMLInputElement, share) => {
        input.value = String(share);
        input.dispatchEvent(new Event("input", { bubbles: true }));
      },
      Math.log(p) / Math.log(12),
    );
  await move(6);
  expect(await said.textContent()).toBe("Solved at p = 6.");
  const at6 = await shown();
  expect(far(at6, before)).toBeGreaterThan(0.01);
  expect(await user.ask("document().p")).toBe(1.5); // not yet
  await move(4.9);
  expect(await said.textContent()).toBe("Interpolated between p = 4 and 6; solved when you let go.");
  const controls = async () => [
    await user.page.getByRole("slider", { name: "p", exact: true }).getAttribute("aria-valuetext"),
    await user.page.locator(".p-words").textContent(),
    await user.page.locator("canvas.stage").getAttribute("aria-label"),
  ];
  const everyPlace = "No peaks: every place gives a little";
  expect(await controls()).toEqual(["4.9", everyPlace, "Picture of the surface, p = 4.9"]);
  const at5 = await shown();
  expect(await sent()).toBe(asked);
  await blend().dispatchEvent("change");
  await user.until("window.__lpdeform.document().p === 4.9");
  await user.settled();
  const solved = await shown();
  expect(far(solved, await user.positions())).toBe(0); // the frame's, and no preview any more
  expect(far(solved, at5)).toBeLessThan(0.25 * far(at6, before));
  await user.page.keyboard.press("Control+z");
  expect(await user.ask("document().p")).toBe(1.5);
});

it("shapes of other work are dropped, and prepared again", async () => {
  await allReady();
  await user.page.getByRole("textbox", { name: "Moved along x", exact: true }).fill("0.2");
  await user.page.keyboard.press("Enter");
  await fewReady();
  await allReady();
  await user.ask("app.view.set({ weldTolerance: 1e-4 })"); // other vertices count as one
  await fewReady();
  await allReady();
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("a");
  await status().filter({ hasText: "p comes from the shape" }).waitFor();
  expect(await blend().isDisabled()).toBe(true);
});

it("the session for it is there while it solves, and ends with the last shape and when the page is hidden", async () => {
  const calls: string[] = [];
  user.page.on("request", (request) => calls.push(new URL(request.url()).pathname.split("/").at(-1)!));
  const count = (name: string) => calls.filter((call) => call === name).length;
  await allReady();
  await expect.poll(() => count("DeleteSession"), { timeout: 20_000 }).toBe(1);
  const created = count("CreateSession");
  await user.ask("app.view.set({ weldTolerance: 1e-4 })");
  await expect.poll(() => count("CreateSession"), { timeout: 20_000 }).toBe(created + 1);
  // A session whose creation is given up has no name to be deleted by.
  await status()
    .filter({ hasText: /^[1-9]\d* of 12 shapes are ready/ })
    .waitFor();
  await user.page.evaluate(() => {
    Object.defineProperty(document, "visibilityState", { value: "hidden", configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await expect.poll(() => count("DeleteSession"), { timeout: 20_000 }).toBe(2);
});

it("Escape ends the preview without a change, and other keys leave it as it is", async () => {
  await allReady();
  const { mouse, keyboard } = user.page;
  const work = async () => [
    await user.ask("document().p"),
    await user.ask("app.history.stepsSoFar.past.length"),
    await user.ask("app.view.now.selected"),
  ];
  const [before, rest] = [await work(), await shown()];
  await blend().scrollIntoViewIfNeeded();
  const { x, y, width, height } = (await blend().boundingBox())!;
  const at = (share: number) => mouse.move(x + share * width, y + height / 2);
  await at(0.3);
  await mouse.down();
  await at(0.8);
  const held = await blend().inputValue();
  await keyboard.press("Shift");
  expect(await work()).toEqual(before);
  expect(await shown()).not.toEqual(rest);
  expect(await blend().inputValue()).toBe(held);
  await keyboard.press("Escape");
  expect(await work()).toEqual(before);
  expect(await shown()).toEqual(rest);
  const own = await blend().inputValue();
  await at(0.9);
  expect(await blend().inputValue()).toBe(own);
  const label = await user.page.locator("canvas.stage").getAttribute("aria-label");
  expect(label).toBe("Picture of the surface, p = 1.5");
  await mouse.up();
  expect(await work()).toEqual(before);
  expect(await shown()).toEqual(rest);
});
