import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
});

afterAll(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
  await service.stop();
});

const press = (key: string) => user.page.keyboard.press(key);
const focused = () =>
  user.page.evaluate<string>(
    "(({ activeElement: one }) => one.matches('canvas') ? 'canvas' : one.getAttribute('aria-label') ?? one.textContent)(document)",
  );

it("Tab goes round the whole page, and back", async () => {
  const canFocus = await user.page.evaluate<number>(
    "[...document.querySelectorAll('a[href], button, input, select, textarea, summary, canvas[tabindex]')].filter((one) => one.checkVisibility() && !one.disabled && one.tabIndex >= 0 && one.type !== 'file').length",
  );
  for (const key of ["Tab", "Shift+Tab"]) {
    await user.page.locator("canvas.stage").focus();
    const round = [await focused()];
    for (let k = 0; k < canFocus + 5; ++k) {
      await press(key);
      const name = await focused();
      if (name === "canvas") break;
      round.push(name);
    }
    expect(await focused()).toBe("canvas");
    expect(round.length).toBeGreaterThanOrEqual(canFocus);
    expect(round).toEqual(expect.arrayContaining(["Open", "Move", "Name", "How it is held"]));
  }
});

it("I opens and closes the side panel", async () => {
  await user.page.locator("canvas.stage").focus();
  await press("i");
  expect(await user.ask("app.view.now.isPanelOpen")).toBe(false);
  await press("I");
  expect(await user.ask("app.view.now.isPanelOpen")).toBe(true);
});

it("what is deleted is selected again when that is undone", async () => {
  const { keyboard } = user.page;
  await user.page.locator("canvas.stage").focus();
  await keyboard.press("n");
  const name = await user.ask<string>("app.view.now.selected");
  await keyboard.press("Delete");
  expect(await user.ask<string | undefined>("app.view.now.selected")).toBeUndefined();
  await keyboard.press("Control+z");
  expect(await user.ask("app.view.now.selected")).toBe(name);
  await keyboard.press("Escape");
  await keyboard.press("Control+Shift+z");
  expect(await user.ask("document().handles.length")).toBe(1);
  await keyboard.press("Control+z");
});

it("the focus stays in the list while a handle is selected, renamed, locked and set", async () => {
  const rows = user.page.locator(".handles li");
  await rows.nth(0).getByLabel("Name").focus();
  expect(await focused()).toBe("Name");
  expect(await user.ask("app.view.now.selected === window.__lpdeform.document().handles[0].name")).toBe(true);
  await press("Control+A");
  await user.page.keyboard.type("Foot");
  await press("Enter");
  expect(await user.ask("document().handles[0].name")).toBe("Foot");
  expect(await focused()).toBe("Name");
  await press("Tab");
  await press("Enter");
  expect(await user.ask("document().handles[0].isLocked")).toBe(false);
  expect(await focused()).toBe("Lock it against dragging");
  await press("Enter");
  expect(await focused()).toBe("Locked: let it move");

  await user.page.getByLabel("How it is held").focus();
  await press("ArrowDown");
  await user.until("window.__lpdeform.document().handles[0].hold.kind === 'soft'");
  expect(await focused()).toBe("How it is held");
  await user.page.getByLabel("Weight").focus();
  for (const weight of [1.3, 1.6]) {
    await press("ArrowRight");
    await user.until(`window.__lpdeform.document().handles[0].hold.weight === ${weight}`);
    expect(await focused()).toBe("Weight");
  }
});

it("and goes to the handle before where the last one is deleted", async () => {
  const bins = user.page.locator(".handles button:last-child");
  await bins.nth(1).focus();
  await press("Enter");
  expect(await user.ask("document().handles.length")).toBe(1);
  expect(await focused()).toBe("Delete Foot (Delete)");
});

it("what a key does while it is held is undone at once, and a key that changes nothing leaves what can be redone", async () => {
  const { keyboard } = user.page;
  const held = async (key: string) => {
    for (let k = 0; k < 5; ++k) await keyboard.down(key);
    await keyboard.up(key);
  };
  const x = () => user.ask<number>("document().handles[0].pose.translation[0]");
  const p = () => user.ask<number>("document().p");
  await user.ask("app.view.set({ selected: window.__lpdeform.document().handles[0].name })");
  if (await user.ask("document().handles[0].isLocked")) await press("l");
  await user.page.locator("canvas.stage").focus();
  const [before, firstP] = [await x(), await p()];
  await held("ArrowRight");
  expect(await x()).toBeCloseTo(before + 5 * 0.01 * (await user.ask<number>("app.diagonal")), 5);
  await press("Control+z");
  expect(await x()).toBe(before);

  await held(".");
  expect(await p()).toBeCloseTo(firstP + 0.5, 5);
  await press("Control+z");
  expect(await p()).toBe(firstP);
  await user.page.getByRole("slider", { name: "p", exact: true }).focus();
  await held("ArrowRight");
  expect(await p()).toBeCloseTo(firstP + 0.5, 5);
  await press("Control+z");
  expect(await p()).toBe(firstP);

  await user.page.getByLabel("Weight").focus();
  const weight = () => user.ask<number>("document().handles[0].hold.weight");
  const firstWeight = await weight();
  await held("ArrowRight");
  expect(await weight()).toBeGreaterThan(firstWeight);
  await press("Control+z");
  expect(await weight()).toBe(firstWeight);

  await user.page.locator("canvas.stage").focus();
  await user.page.locator(".dock").getByRole("button", { name: "1", exact: true }).click();
  await press(".");
  await press("Control+z");
  await press(","); // 1 is the least
  expect(await user.ask("app.history.canRedo")).toBe(true);
});

it("with rings, arrow keys turn the selected handle on the spot, and it is undone like any step", async () => {
  const pose = () => user.ask<{ rotation: number[]; translation: number[] }>("document().handles[0].pose");
  await user.ask("app.view.set({ selected: window.__lpdeform.document().handles[0].name })");
  await user.page.locator("canvas.stage").focus();
  await press("r");
  const before = await pose();
  for (const [key, axis] of [
    ["ArrowRight", 0],
    ["ArrowUp", 1],
    ["PageUp", 2],
  ] as const) {
    await press(key);
    const { rotation, translation } = await pose();
    expect(rotation[axis]).toBeCloseTo(Math.sin(Math.PI / 120), 6); // half of three degrees
    expect(translation).toEqual(before.translation);
    await press("Control+z");
    expect(await pose()).toEqual(before);
  }
  const rest = await user.positions();
  await press("PageDown");
  await user.settled();
  const turned = await user.positions();
  expect(Math.max(...turned.map((value, k) => Math.abs(value - rest[k]!)))).toBeGreaterThan(0.01);
  await press("Control+z");
  await press("t");
  await press("l");
  const locked = await pose();
  await press("ArrowRight");
  await user.page.locator(".notice", { hasText: "is locked: its padlock in the list lets it move." }).waitFor();
  expect(await pose()).toEqual(locked);
  await press("l");
});

it("a key that turns something on or off does so once, however long it is held", async () => {
  const { keyboard } = user.page;
  const held = async (key: string) => {
    for (let k = 0; k < 4; ++k) await keyboard.down(key);
    await keyboard.up(key);
  };
  await user.page.locator("canvas.stage").focus();
  const switches = { w: "view.now.wireframe", g: "view.now.ghost", i: "view.now.isPanelOpen" };
  for (const [key, what] of Object.entries(switches)) {
    const before = await user.ask<boolean>(`app.${what}`);
    await held(key);
    expect(await user.ask(`app.${what}`)).toBe(!before);
    await press(key);
    expect(await user.ask(`app.${what}`)).toBe(before);
  }
  await user.ask("app.view.set({ selected: window.__lpdeform.document().handles[0].name })");
  const isLocked = await user.ask<boolean>("document().handles[0].isLocked");
  await held("l");
  expect(await user.ask("document().handles[0].isLocked")).toBe(!isLocked);
  await press("l");

  const count = await user.ask<number>("document().handles.length");
  await held("Enter"); // shows the cross, and does not press as well
  expect(await user.page.locator(".cross").isVisible()).toBe(true);
  expect(await user.ask("document().handles.length")).toBe(count);
  await press("Escape");
});

it("the view turns, shifts and zooms by keys", async () => {
  await user.page.locator("canvas.stage").focus();
  interface Look {
    position: number[];
    target: number[];
  }
  const look = () => user.ask<Look>("app.panes[0].stage.look");
  const away = ({ position, target }: Look) => Math.hypot(...position.map((value, axis) => value - target[axis]!));
  await press("f");
  const first = await look();
  for (const keys of ["Control+ArrowRight", "Control+ArrowUp"]) await press(keys);
  const turned = await look();
  turned.target.forEach((value, axis) => expect(value).toBeCloseTo(first.target[axis]!, 9));
  expect(away(turned)).toBeCloseTo(away(first), 5);
  expect(Math.hypot(...turned.position.map((value, axis) => value - first.position[axis]!))).toBeGreaterThan(0.1 * away(first));
  for (const keys of ["Control+ArrowDown", "Control+ArrowLeft"]) await press(keys);
  (await look()).position.forEach((value, axis) => expect(value).toBeCloseTo(first.position[axis]!, 4));

  await press("Control+Shift+ArrowRight");
  const shifted = await look();
  const by = shifted.target.map((value, axis) => value - first.target[axis]!);
  expect(Math.hypot(...by)).toBeGreaterThan(0.01 * away(first));
  expect(away(shifted)).toBeCloseTo(away(first), 5);
  await press("+");
  expect(away(await look())).toBeLessThan(0.9 * away(first));
  await press("-");
  expect(away(await look())).toBeCloseTo(away(first), 4);

  await press("Escape"); // no handle is selected: then arrows alone turn the view
  await press("ArrowLeft");
  expect((await look()).position).not.toEqual(shifted.position);
  await press("f");
});

it("a handle is placed, moved and selected by keys alone", async () => {
  await user.page.locator("canvas.stage").focus();
  const cross = user.page.locator(".cross");
  const count = await user.ask<number>("document().handles.length");
  await press("Enter");
  expect(await cross.isVisible()).toBe(true);
  expect((await user.ask<number[]>("app.facts.now.pointedOut.vertices")).length).toBeGreaterThan(0);
  await press("ArrowUp");
  await press("Enter");
  expect(await cross.isVisible()).toBe(false);
  expect(await user.ask("document().handles.length")).toBe(count + 1);
  const name = await user.ask<string>("document().handles.at(-1).name");
  expect(await user.ask("app.view.now.selected")).toBe(name);
  await user.page.locator(".notice", { hasText: `“${name}” holds` }).waitFor();
  const x = () => user.ask<number>("document().handles.at(-1).pose.translation[0]");
  const before = await x();
  await press("ArrowRight");
  expect(await x()).toBeGreaterThan(before);
  await user.settled();

  await press("Escape");
  expect(await user.ask("app.view.now.selected")).toBe(undefined);
  await press("Enter"); // in the middle again
  await press("Escape");
  expect(await cross.isVisible()).toBe(false);
  await press("Delete");
  expect(await user.ask("document().handles.length")).toBe(count + 1);
});

it("the cross goes by steps and by pixels, stays on the picture, and goes away with the focus, a press elsewhere and Escape", async () => {
  const canvas = user.page.locator("canvas.stage");
  const cross = user.page.locator(".cross");
  const { width, height } = (await canvas.boundingBox())!;
  // The browser leaves a second length out where it is 0.
  const at = () =>
    cross.evaluate((one) => {
      const [x, y = 0] = one.style.translate.split(" ").map(parseFloat);
      return [x!, y] as const;
    });
  const count = await user.ask<number>("document().handles.length");
  await canvas.focus();
  await press("ArrowLeft"); // without a cross, keys are the view's
  expect(await cross.isVisible()).toBe(false);
  await press("Enter");
  const [x, y] = await at();
  await press("ArrowRight");
  await press("ArrowDown");
  const [stepped, down] = await at();
  expect(stepped - x).toBeCloseTo(0.02 * height, 1);
  expect(down - y).toBeCloseTo(0.02 * height, 1);
  await press("Shift+ArrowLeft");
  await press("Shift+ArrowUp");
  expect(await at()).toEqual([expect.closeTo(stepped - 1, 3), expect.closeTo(down - 1, 3)]);

  const step = Math.ceil(1 / 0.02) + 1; // as many as the picture is high
  for (let k = 0; k < step; ++k) await press("ArrowUp");
  expect((await at())[1]).toBe(0);
  expect(await user.ask("app.facts.now.pointedOut.vertices")).toEqual([]); // nothing lies under it there
  await press("Enter");
  expect([await cross.isVisible(), await user.ask("document().handles.length")]).toEqual([true, count]);
  for (let k = 0; k < 2 * step * Math.ceil(width / height); ++k) await press("ArrowLeft");
  expect(await at()).toEqual([0, 0]);

  await press("Tab");
  expect(await cross.isVisible()).toBe(false);
  await canvas.focus();
  expect(await cross.isVisible()).toBe(false); // it has to be asked for again
  await press("Enter");
  const box = (await canvas.boundingBox())!;
  await user.page.mouse.click(box.x + 5, box.y + height - 5);
  expect(await cross.isVisible()).toBe(false);
  await press("Enter");
  const before = await at();
  await press("Control+ArrowRight"); // turns the view
  expect(await at()).toEqual(before);
  await press("Escape");
  expect(await cross.isVisible()).toBe(false);
  expect(await user.ask("document().handles.length")).toBe(count);
  await press("f");
});

it("the help begins at its beginning", async () => {
  await user.page.setViewportSize({ width: 1280, height: 600 });
  await press("?");
  const help = user.page.getByRole("dialog", { name: "Help" });
  expect(await help.evaluate((dialog) => [dialog.scrollTop, dialog.scrollHeight > dialog.clientHeight])).toEqual([0, true]);
  await press("Escape");
  await help.waitFor({ state: "hidden" });
  await user.page.setViewportSize({ width: 1280, height: 800 });
});

it("shortcuts of a single key can be switched off, and stay so", async () => {
  await press("?");
  const help = user.page.getByRole("dialog", { name: "Help" });
  await help.getByText("Shortcuts of a single key").click();
  await press("Escape");
  await user.page.locator("canvas.stage").focus();
  const before = await user.ask<object>("app.view.now");
  for (const key of ["2", "w", "g", "s", "d", "i", "p", "[", "?"]) await press(key);
  expect(await user.ask("app.view.now")).toEqual(before);
  expect(await help.isVisible()).toBe(false);
  await press("Control+z"); // is no single key
  expect(await user.ask("app.history.canRedo")).toBe(true);

  await user.page.reload();
  await user.settled();
  await press("w");
  expect(await user.ask("app.view.now.wireframe")).toBe(false);
  await user.page.getByRole("button", { name: "Help and shortcuts (?)" }).click();
  await help.getByText("Shortcuts of a single key").click();
  await press("Escape");
  await press("w");
  expect(await user.ask("app.view.now.wireframe")).toBe(true);
});
