import type { CDPSession } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { User } from "../real/user.js";
import { Up } from "./up.js";

let up: Up;
let user: User;
let browser: CDPSession;

beforeAll(async () => {
  up = await Up.start();
  user = await User.open("about:blank");
  browser = await user.browser.newBrowserCDPSession();
  // Every press and every key of the user, from the first moment of the page on.
  await user.page.addInitScript(() => {
    const inputs: string[] = [];
    for (const kind of ["pointerdown", "keydown", "wheel"]) {
      addEventListener(kind, ({ isTrusted }) => isTrusted && inputs.push(kind), { capture: true });
    }
    Object.assign(window, { inputs });
  });
});

afterAll(async () => {
  await user?.close();
  await up?.stop();
});

/** Since the page was asked for, in seconds. */
const now = () => user.page.evaluate<number>("performance.now() / 1000");
const mostSeconds = 10;

it("somebody who opens the page and drags what it points out has a deformed surface, with nothing to do before", async () => {
  const before = await up.computedWith(browser);
  await user.page.goto(up.url);
  await user.settled();
  const shown = await now();

  // A shape that is held and can be pulled, a p to choose, nothing in the way; what to do is said in words.
  await user.page.locator(".hint", { hasText: "Drag the coloured handle and watch the surface follow" }).waitFor();
  expect(await user.ask("document().handles.length")).toBeGreaterThanOrEqual(2);
  expect(await user.page.locator("dialog[open]").count()).toBe(0);
  expect(await user.page.getByRole("slider", { name: "p", exact: true }).isEnabled()).toBe(true);

  const vertex = await user.ask<number>(
    "document().handles.find(({ name }) => name === window.__lpdeform.app.view.now.selected).vertices[0]",
  );
  const rest = await user.positions();
  const { x, y } = await user.vertexOnPage(vertex);
  await user.page.mouse.move(x, y);
  await user.page.mouse.down();
  await user.page.mouse.move(x + 30, y - 20);
  await user.until("window.__lpdeform.meter().inputs > 0"); // the answer is on the screen, the button still down
  const [follows, work] = [await now(), (await up.computedWith(browser)) - before];
  await user.page.mouse.move(x + 60, y - 40);
  await user.page.mouse.up();
  await user.settled();

  expect(await user.page.evaluate("window.inputs")).toEqual(["pointerdown"]);
  const moved = (await user.positions()).filter((value, k) => Math.abs(value - rest[k]!) > 1e-3).length;
  expect(moved).toBeGreaterThan(0.1 * rest.length); // not the handle alone
  expect(await user.ask("app.red")).toBeGreaterThan(0);
  expect(user.errors).toEqual([]);
  const times = `after ${shown.toFixed(1)} s there is a shape, after ${follows.toFixed(1)} s it follows`;
  console.info(`${times}; page, server and Envoy computed for ${work.toFixed(1)} s`);
  expect(work).toBeLessThan(mostSeconds);
});

it("and one press changes p", async () => {
  const before = await user.positions();
  await user.page.locator(".dock").getByRole("button", { name: "6", exact: true }).click();
  await user.settled();
  const change = (await user.positions()).map((value, k) => Math.abs(value - before[k]!));
  expect(Math.max(...change)).toBeGreaterThan(1e-3);
  expect(await user.page.evaluate("window.inputs")).toEqual(["pointerdown", "pointerdown"]);
});
