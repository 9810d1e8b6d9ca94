import { beforeEach, expect, it } from "vitest";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers(bar, (one) => (user = one));

beforeEach(async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 120, 60);
  await user.settled();
  await user.page.getByText("Blend through p").click();
});

const status = () => user.page.locator(".blend [role=status]");
const blend = () => user.page.getByRole("slider", { name: "Blend p" });
const prepare = () => user.page.getByRole("checkbox", { name: "Prepare blending" }).setChecked(true, { force: true });
const shown = () => user.page.evaluate<number[]>("[...window.__lpdeform.app.panes[0].stage.surface.positions]");
const far = (a: readonly number[], b: readonly number[]) => Math.max(...a.map((value, k) => Math.abs(value - b[k]!)));

it("a slider passes through prepared shapes, says which are interpolated, and is solved when it is let go", async () => {
  expect(await blend().isDisabled()).toBe(true);
  await prepare();
  await status().filter({ hasText: "All shapes are ready." }).waitFor({ timeout: 60_000 });
  const before = await shown();
  const said = user.page.locator(".blend p").last();
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
  const at5 = await shown();
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
  await prepare();
  await status().filter({ hasText: "All shapes are ready." }).waitFor({ timeout: 60_000 });
  await user.page.getByRole("textbox", { name: "Moved along x", exact: true }).fill("0.2");
  await user.page.keyboard.press("Enter");
  await user.until("document.querySelector('.blend input[type=range]').disabled");
  await status().filter({ hasText: "All shapes are ready." }).waitFor({ timeout: 60_000 });
  await user.ask("app.view.set({ weldTolerance: 1e-4 })"); // other vertices count as one
  await user.until("document.querySelector('.blend input[type=range]').disabled");
  await status().filter({ hasText: "All shapes are ready." }).waitFor({ timeout: 60_000 });
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("a");
  await status().filter({ hasText: "p comes from the shape" }).waitFor();
});
