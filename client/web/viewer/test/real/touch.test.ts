import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import { decodePng, User } from "./user.js";

let user: User;

withUser(bar, (one) => (user = one), { width: 820, height: 1180, hasTouch: true });

type Point = { x: number; y: number };

/** Fingers that go down at the first points, over the next, and up. */
async function touch(...steps: Point[][]): Promise<void> {
  const devtools = await user.page.context().newCDPSession(user.page);
  const send = (type: "touchStart" | "touchMove" | "touchEnd", points: Point[]) =>
    devtools.send("Input.dispatchTouchEvent", { type, touchPoints: points.map((point, id) => ({ ...point, id })) });
  let down = 0;
  for (const points of steps) {
    await send(points.length > down ? "touchStart" : "touchMove", points);
    down = points.length;
  }
  await send("touchEnd", []);
  await devtools.detach();
}

const camera = () =>
  user.ask<number>("app.panes[0].stage.camera.position.distanceTo(window.__lpdeform.app.panes[0].stage.target)");

it("a finger drags a handle, and the surface follows", async () => {
  const rest = await user.positions();
  const vertex = await user.ask<number>("document().handles[1].vertices[0]");
  const { x, y } = await user.vertexOnPage(vertex);
  await touch([{ x, y }], [{ x: x + 20, y: y + 5 }], [{ x: x + 60, y: y + 20 }], [{ x: x + 90, y: y + 30 }]);
  await user.settled();
  const bent = await user.positions();
  expect(Math.max(...bent.map((value, k) => Math.abs(value - rest[k]!)))).toBeGreaterThan(0.2);
});

it("no notice lies over what a finger drags", async () => {
  const notice = user.page.locator(".notice");
  const isShown = () => notice.evaluate((element) => element.checkVisibility({ visibilityProperty: true }));
  const { x, y } = await user.vertexOnPage(await user.ask<number>("document().handles[1].vertices[0]"));
  const devtools = await user.page.context().newCDPSession(user.page);
  const send = (type: "touchStart" | "touchMove" | "touchEnd", touchPoints: Point[]) =>
    devtools.send("Input.dispatchTouchEvent", { type, touchPoints });
  for (const isBad of [false, true]) {
    await user.ask(`app.notify("What was just opened", ${isBad})`);
    expect(await isShown()).toBe(true);
    await send("touchStart", [{ x, y }]);
    await send("touchMove", [{ x: x + 20, y }]);
    await expect.poll(isShown).toBe(false);
    await send("touchMove", [{ x, y }]);
    await send("touchEnd", []);
    await expect.poll(isShown).toBe(isBad); // an error has still to be read
  }
  await devtools.detach();
  await user.settled();
});

it("a tap on the surface places a handle", async () => {
  const { x, y } = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2]));
  await user.page.touchscreen.tap(x, y);
  expect(await user.ask("document().handles.length")).toBe(3);
});

it("upright, the sliders of p stay in reach beside the open panel, for one picture and for two", async () => {
  const { page } = user;
  const stop = (row: number, value: string) =>
    page.locator(".p-row").nth(row).getByRole("button", { name: value, exact: true });
  await page.getByRole("button", { name: "Side panel" }).tap();
  await page.locator(".panel").waitFor();
  await stop(0, "6").tap();
  expect(await user.ask("document().p")).toBe(6);
  await page.getByTitle("Two values of p side by side").tap();
  await user.settled(1);
  await stop(1, "1").tap();
  await stop(0, "2").tap();
  expect([await user.ask("document().p"), await user.ask("document().secondP")]).toEqual([2, 1]);
  for (const isOn of [true, false]) {
    await page.locator(".dock .toggle").tap();
    expect(await user.ask("document().isAutomatic")).toBe(isOn);
  }
  // Each at the lower edge of its own picture, clear of the legend, the panel and each other.
  const boxes = [".p-row >> nth=0", ".p-row >> nth=1", ".legend", ".dock .under", ".panel"];
  const [first, second, ...others] = await Promise.all(boxes.map((box) => page.locator(box).boundingBox()));
  const panes = await Promise.all([0, 1].map((k) => page.locator(".pane").nth(k).boundingBox()));
  [first!, second!].forEach((slider, k) => {
    expect(slider.y).toBeGreaterThan(panes[k]!.y + panes[k]!.height / 2);
    expect(slider.y + slider.height).toBeLessThan(panes[k]!.y + panes[k]!.height);
    for (const other of others) {
      const isApart =
        slider.x >= other!.x + other!.width ||
        other!.x >= slider.x + slider.width ||
        slider.y >= other!.y + other!.height ||
        other!.y >= slider.y + slider.height;
      expect(isApart).toBe(true);
    }
  });
  // So they lie in an exported picture.
  const picture = decodePng(await user.save("Picture as PNG"));
  expect(picture.height / picture.width).toBeCloseTo((panes[0]!.height + panes[1]!.height) / panes[0]!.width, 1);
  await page.getByTitle("Two values of p side by side").tap();
  await page.getByRole("button", { name: "Side panel" }).tap();
  await user.settled();
});

it("fingers are told to tap, and not to click", async () => {
  const { page } = user;
  await page.getByRole("button", { name: "Side panel" }).tap();
  const count = await user.ask<number>("document().handles.length");
  for (let k = 0; k < count; ++k) await page.locator(".handles button:last-child").first().tap();
  expect(await page.locator(".handles").textContent()).toBe("None yet: tap the surface.");
  await page.getByRole("button", { name: "Side panel" }).tap();
  expect(await page.locator(".hint").textContent()).toBe("Tap the surface to place a first handle");
  await user.page.getByRole("button", { name: "Save" }).tap();
  await user.page.getByRole("menuitem", { name: "Handles as JSON" }).tap();
  await page.locator(".notice.bad", { hasText: "tap the surface to place one" }).waitFor();
  for (let k = 0; k < count; ++k) await page.getByRole("button", { name: "Undo" }).tap();
  expect(await user.ask<number>("document().handles.length")).toBe(count);
});

it("everything that fingers press is large enough for them", async () => {
  await user.page.getByRole("button", { name: "Side panel" }).tap();
  const small = await user.page.evaluate(() =>
    [...document.querySelectorAll("button, select, label.toggle, input[type=range], summary")]
      .filter((one) => one.checkVisibility() && one.getBoundingClientRect().width > 0)
      .map((one) => ({ name: one.getAttribute("aria-label") ?? one.textContent, ...one.getBoundingClientRect().toJSON() }))
      .filter(({ width, height }) => Math.min(width, height) < 24) // WCAG 2.2, 2.5.8
      .map(({ name, width, height }) => `${name}: ${width} by ${height}`),
  );
  expect(small).toEqual([]);
  await user.page.getByRole("button", { name: "Side panel" }).tap();
});

it("two fingers zoom, also where the first had begun to paint", async () => {
  await user.page.getByRole("button", { name: "Brush", exact: true }).tap();
  const before = await camera();
  const { x, y } = await user.vertexOnPage(await user.vertexNear([0.5, 0, 3.5]));
  const count = await user.ask("document().handles.length");
  const pair = (gap: number) => [
    { x, y },
    { x, y: y + gap },
  ];
  await touch([{ x, y }], pair(100), pair(140), pair(200), pair(260));
  expect(await camera()).toBeLessThan(0.9 * before);
  expect(await user.ask("document().handles.length")).toBe(count);
  expect(user.errors).toEqual([]);
});
