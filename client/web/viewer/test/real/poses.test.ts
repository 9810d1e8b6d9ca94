import { beforeEach, expect, it } from "vitest";
import { bar, withNewUsers } from "./opened.js";
import { readProject } from "../../src/io/project.js";
import type { User } from "./user.js";

let user: User;

withNewUsers(bar, (one) => (user = one));

beforeEach(async () => {
  await user.page.locator("summary", { hasText: "Poses" }).click();
});

const button = (name: string) => user.page.getByRole("button", { name, exact: true });
const moved = async () => (await user.ask<{ pose: { translation: number[] } }[]>("document().handles"))[1]!.pose.translation;

it("poses are kept, gone to and played with the solver filling in, as one step; Escape reverts them", async () => {
  expect(await button("Play").isDisabled()).toBe(true);
  await button("Keep this pose").click();
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 100, 50);
  const there = await moved();
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("k");
  await user.settled();
  const bent = await user.positions();
  await button("Pose 1").click();
  expect(await moved()).toEqual([0, 0, 0]);

  await user.page.evaluate(`
    window.between = [];
    window.__lpdeform.app.facts.watch(
      ({ document }) => [document.handles[1].pose.translation[0]],
      ([x]) => window.between.push(x / ${there[0]}),
    )`);
  await button("Play").click();
  await user.until("window.between.at(-1) === 1");
  await button("Play").waitFor();
  const shares = await user.page.evaluate<number[]>("window.between");
  expect(shares.length).toBeGreaterThan(10);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
  expect(await moved()).toEqual(there);
  await user.settled();
  const end = await user.positions();
  expect(Math.abs(end[3 * vertex!]! - bent[3 * vertex!]!)).toBeLessThan(1e-3);
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("Control+z");
  expect(await moved()).toEqual([0, 0, 0]);

  await button("Play").click();
  await user.until("window.__lpdeform.document().handles[1].pose.translation[0] !== 0");
  await user.page.evaluate(`{
    const held = [];
    const { requestAnimationFrame } = window;
    window.requestAnimationFrame = (step) => held.push(step); // it plays on once it is asked to
    window.playOn = () => {
      window.requestAnimationFrame = requestAnimationFrame;
      for (const step of held) requestAnimationFrame(step);
    };
  }`);
  const saved = await user.downloaded(() => user.page.keyboard.press("Control+s"));
  const { document } = await readProject("a.lpdeform", new Uint8Array(saved));
  expect(document.handles[1]!.pose.translation).toEqual([0, 0, 0]);
  expect(await button("Stop").isVisible()).toBe(true);
  await user.page.keyboard.press("Escape");
  await user.page.evaluate("window.playOn()");
  await button("Play").waitFor();
  expect(await moved()).toEqual([0, 0, 0]);
  await button("Delete Pose 1").click();
  await button("Pose 1").waitFor({ state: "detached" });
  expect(await button("Play").isDisabled()).toBe(true);
});
