import { beforeEach, expect, it } from "vitest";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers(bar, (one) => (user = one));

beforeEach(async () => {
  await user.page.locator('[data-handle="Top"] .name').click();
});

const field = (name: string) => user.page.getByRole("textbox", { name, exact: true });
const pose = () => user.ask<{ translation: number[]; rotation: number[] }>("document().handles[1].pose");

it("a handle is moved and turned by numbers, which follow a drag, and each entry is a step", async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  const rest = (await user.positions()).slice(3 * vertex!, 3 * vertex! + 3);
  await field("Moved along x").fill("0,75");
  await field("Moved along x").press("Enter");
  await user.settled();
  expect((await pose()).translation).toEqual([0.75, 0, 0]);
  expect((await user.positions())[3 * vertex!]).toBeCloseTo(rest[0]! + 0.75, 3);
  await field("Turned about z").fill("90");
  await field("Turned about z").press("Tab");
  expect((await pose()).rotation[2]).toBeCloseTo(Math.SQRT1_2, 12);
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("Control+z");
  expect(await field("Turned about z").inputValue()).toBe("0");
  await user.page.keyboard.press("Control+z");
  expect(await field("Moved along x").inputValue()).toBe("0");

  await user.drag(await user.vertexOnPage(vertex!), 60, 0);
  const [x] = (await pose()).translation;
  expect(Number(await field("Moved along x").inputValue())).toBeCloseTo(x!, 3);
});

it("arrow keys change a number by steps, Escape drops what was typed, and what is no number is refused", async () => {
  const y = field("Moved along y");
  await y.press("ArrowUp");
  const [, step] = (await pose()).translation;
  expect(step).toBeGreaterThan(0);
  await y.press("Shift+ArrowDown");
  expect((await pose()).translation[1]).toBeCloseTo(-9 * step!, 12);
  await y.fill("7");
  await y.press("Escape");
  expect(await y.inputValue()).not.toBe("7");
  for (const nonsense of ["", "abc", "1e999", "Infinity"]) {
    await y.fill(nonsense);
    await y.press("Enter");
    expect(await user.page.locator(".notice.bad").textContent()).toContain("Moved along y is a number from");
  }
  expect((await pose()).translation[1]).toBeCloseTo(-9 * step!, 12);
  await user.page.getByRole("button", { name: "Lock it against dragging" }).nth(0).click();
  expect(await y.isDisabled()).toBe(true);
});

it("p is typed, within its range", async () => {
  const p = field("Value of p");
  await p.fill("3.25");
  await p.press("Enter");
  expect(await user.ask("document().p")).toBe(3.25);
  await p.fill("13");
  await p.press("Enter");
  expect(await user.page.locator(".notice.bad").textContent()).toBe("Value of p is a number from 1 to 12.");
  expect([await user.ask("document().p"), await p.inputValue()]).toEqual([3.25, "3.25"]);
  await p.press("ArrowUp");
  expect(await user.ask("document().p")).toBe(3.26);
  await user.page.keyboard.press("s");
  expect(await user.ask("app.view.now.isSplit")).toBe(false); // typed, not pressed
  await user.page.getByRole("button", { name: "Two values of p side by side (S)" }).click();
  await field("Value of p of the right picture").fill("4");
  await field("Value of p of the right picture").press("Enter");
  expect(await user.ask("document().secondP")).toBe(4);
  await user.page.getByRole("checkbox", { name: "Automatic" }).setChecked(true, { force: true });
  expect(await field("Value of p of the left picture").inputValue()).toBe("auto");
});

it("five digits with a sign can be read whole", async () => {
  await field("Moved along x").fill("-0.34304");
  await field("Moved along x").press("Enter");
  const widths = () =>
    field("Moved along x").evaluate((input: HTMLInputElement) => [input.value, input.scrollWidth - input.clientWidth]);
  expect(await widths()).toEqual(["-0.34304", 0]);
});
