import { expect, it } from "vitest";
import { withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers("/?shape=bar&detail=medium", (one) => (user = one));

/** The painted values that differ, rising. */
const painted = async () => {
  const values = await user.page.evaluate<number[]>(
    `[...(window.__lpdeform.document().paintedP ?? [])].filter((value) => !Number.isNaN(value))`,
  );
  return [...new Set(values)].sort((a, b) => a - b);
};
const mode = (name: string) => user.page.getByRole("button", { name, exact: true }).click();

it("a soft brush blends, is seen while it paints, and is cancelled by Escape; smoothing and erasing follow", async () => {
  const { page } = user;
  await page.keyboard.press("e");
  expect(await user.ask("app.view.now.tool")).toBe("paint");
  await page.getByRole("slider", { name: "Soft" }).fill("1");
  await user.ask("app.view.set({ paintP: 6, radius: 0.12 })");
  const { x, y } = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.5]));
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 2, y + 30, { steps: 3 });
  const soft = await painted(); // before it is let go
  expect(soft.length).toBeGreaterThan(10);
  expect(soft[0]).toBeGreaterThanOrEqual(1.5); // between the slider's p and the brush's
  expect(soft.at(-1)).toBeGreaterThan(5);
  expect(soft.at(-1)).toBeLessThanOrEqual(6);
  expect(await user.ask("app.view.now.colourBy")).toBe("p");
  await page.keyboard.press("Escape");
  await page.mouse.up();
  expect(await painted()).toEqual([]);

  await user.drag({ x, y }, 2, 30);
  const before = await painted();
  expect(await user.ask("app.history.canUndo")).toBe(true);
  await mode("Smooth");
  await user.drag({ x, y }, 2, 30);
  const smooth = await painted();
  expect(smooth.at(-1)).toBeLessThan(before.at(-1)!);
  await mode("Erase");
  await page.getByRole("slider", { name: "Soft" }).fill("0");
  await user.ask("app.view.set({ radius: 0.25 })");
  await user.drag({ x, y }, 2, 30);
  expect(await user.page.evaluate("'paintedP' in window.__lpdeform.document()")).toBe(false);
  await page.keyboard.press("Control+z");
  expect(await painted()).toEqual(smooth);
});

it("folds are painted in one step, more where the surface bends more, and nothing where it is flat", async () => {
  await user.page.keyboard.press("e");
  await user.ask("app.view.set({ paintP: 8, radius: 0.05 })");
  await user.page.getByRole("button", { name: "Paint folds" }).click();
  const at = async (place: [number, number, number]) => {
    const value = await user.ask<number>(`document().paintedP[${await user.vertexNear(place)}]`);
    return Number.isNaN(value) ? undefined : value;
  };
  expect(await at([10, 10, 5])).toBeGreaterThan(2); // an edge of the bar
  expect((await painted()).at(-1)).toBeLessThanOrEqual(8);
  expect(await user.ask("app.view.now.colourBy")).toBe("p");
  await user.settled();
  await user.page.keyboard.press("Control+z");
  expect(await painted()).toEqual([]);
});
