import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

// At every size, nothing that is pressed or read covers anything else.

let service: Service;
let user: User;
/** The same page under fingers, where what is pressed is larger. */
let touching: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
  touching = await User.open(`${service.url}/?shape=bar&detail=coarse`, { hasTouch: true });
  await touching.settled();
});

afterAll(async () => {
  expect([...user.errors, ...touching.errors]).toEqual([]);
  await user.close();
  await touching.close();
  await service.stop();
});

const sizes: (readonly [number, number])[] = [
  [360, 640],
  [390, 844],
  [414, 896],
  [600, 960],
  [640, 360],
  [667, 375],
  [740, 360],
  [768, 1024],
  [844, 390],
  [932, 430],
  [1024, 600],
  [1024, 768],
  [1280, 720],
  [1280, 800],
  [1440, 900],
  [1920, 1080],
  [2560, 1440],
  [3840, 2160],
];
const states = [false, true].flatMap((isSplit) =>
  [false, true].flatMap((isPanelOpen) => (["move", "paint", "lasso"] as const).map((tool) => ({ isSplit, isPanelOpen, tool }))),
);

/** Where room is little, these leave the pictures free. */
const beside = [".topbar", ".rail", ".options", ".dock", ".panel", ".hint", ".legend"];
const isLittle = (width: number, height: number) => (width <= 720 && width <= height) || (height <= 560 && height <= width);
const little = sizes.filter(([width, height]) => isLittle(width, height));
const drawn = ({ page }: User) =>
  page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));

/** What stands over the pictures or beside them, and must not meet. */
const parts = [
  ".topbar",
  ".topbar > *",
  ".rail",
  ".options",
  ".legend",
  ".dock",
  ".pill",
  ".banner",
  ".hint",
  ".notice",
  ".panel",
];

/** Pairs that overlap by more than a pixel of rounding, and what is cut off by the window. */
function faults([parts, beside]: readonly (readonly string[])[]): string[] {
  const boxes = [".pane", ...parts!].flatMap((part) =>
    [...document.querySelectorAll<HTMLElement>(part)]
      .map((element) => ({ part, element, box: element.getBoundingClientRect() }))
      .filter(({ element, box }) => box.width * box.height > 0 && element.checkVisibility({ visibilityProperty: true })),
  );
  const found: string[] = [];
  boxes.forEach(({ part, box, element }, k) => {
    if (box.left < -1 || box.top < -1 || box.right > innerWidth + 1 || box.bottom > innerHeight + 1)
      found.push(`${part} is cut off`);
    for (const other of boxes.slice(k + 1)) {
      if (part === ".pane" && !beside!.includes(other.part)) continue;
      if (element.contains(other.element) || other.element.contains(element)) continue;
      const wide = Math.min(box.right, other.box.right) - Math.max(box.left, other.box.left);
      const high = Math.min(box.bottom, other.box.bottom) - Math.max(box.top, other.box.top);
      if (wide > 1 && high > 1) found.push(`${part} and ${other.part} by ${Math.round(wide)} x ${Math.round(high)}`);
    }
  });
  return found;
}

/** By how much what stands over the picture covers the shape that has just been opened, by name. */
function covering(): string[] {
  const { app, vertexOnPage } = (window as any).__lpdeform;
  const count = app.mesh.positions.length / 3;
  const places: { x: number; y: number }[] = Array.from({ length: count }, (_, vertex) => vertexOnPage(vertex));
  const shape = {
    left: Math.min(...places.map(({ x }) => x)),
    right: Math.max(...places.map(({ x }) => x)),
    top: Math.min(...places.map(({ y }) => y)),
    bottom: Math.max(...places.map(({ y }) => y)),
  };
  const pane = document.querySelector(".pane")!.getBoundingClientRect();
  const found: string[] = [];
  if (shape.bottom - shape.top < 0.2 * pane.height) found.push("the shape is small");
  if (shape.left < pane.left || shape.right > pane.right || shape.top < pane.top || shape.bottom > pane.bottom)
    found.push("the shape is cut off");
  for (const part of [".hint", ".legend", ".pill", ".rail", ".options", ".dock"]) {
    const box = document.querySelector(part)!.getBoundingClientRect();
    const within = (place: { x: number; y: number }) =>
      place.x > box.left && place.x < box.right && place.y > box.top && place.y < box.bottom;
    const covered = places.filter(within).length;
    if (covered > 0) found.push(`${part} covers ${covered} of ${count} vertices`);
  }
  return found;
}

/** Choices that are wider than their list is, by name. */
function cutOff(): string[] {
  const arrow = 20;
  const context = document.createElement("canvas").getContext("2d")!;
  return [...document.querySelectorAll("select")].flatMap((list) => {
    if (!list.checkVisibility()) return [];
    const { font, paddingLeft, paddingRight } = getComputedStyle(list);
    context.font = font;
    const room = list.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight) - arrow;
    const widths = [...list.options].map(({ text }) => context.measureText(text).width);
    return Math.max(...widths) > room ? [`${list.ariaLabel ?? list.title} by ${Math.max(...widths) - room}`] : [];
  });
}

it.each([
  [1280, 800],
  [1920, 1080],
])("every choice can be read whole at %d x %d", async (width, height) => {
  await user.page.setViewportSize({ width, height });
  for (const tool of ["move", "paint"]) {
    await user.ask(`app.view.set({ isSplit: false, isPanelOpen: true, tool: "${tool}" })`);
    expect(await user.page.evaluate(cutOff)).toEqual([]);
  }
});

it.each(sizes)("nothing covers the first shape at %d x %d, and the hint is there", async (width, height) => {
  await user.page.setViewportSize({ width, height });
  const found: Record<string, string[]> = {};
  for (const shape of ["bar", "creature", "sheet"]) {
    await user.ask(`app.startOver("${shape}", "coarse")`);
    await user.ask("app.view.set({ isSplit: false, isPanelOpen: false, tool: 'move' })");
    await user.until(`!document.querySelector(".hint").hidden`);
    await drawn(user);
    await user.ask("app.fit()");
    await drawn(user);
    const all = await user.page.evaluate(covering);
    if (all.length > 0) found[shape] = all;
  }
  expect(found).toEqual({});
});

/** Options of the tool that cannot be scrolled into sight and pressed there, by name. */
function outOfReach(): string[] {
  const options = document.querySelector(".options")!;
  return [...options.querySelectorAll<HTMLElement>("button, select, input")].flatMap((control) => {
    const pressed = control.closest<HTMLElement>("label") ?? control;
    if (!pressed.checkVisibility()) return [];
    pressed.scrollIntoView({ block: "center", inline: "center" });
    const { left, right, top, bottom } = pressed.getBoundingClientRect();
    const found = [left + 2, (left + right) / 2, right - 2].map((x) => document.elementFromPoint(x, (top + bottom) / 2));
    return found.every((element) => pressed.contains(element)) ? [] : [control.ariaLabel ?? control.textContent];
  });
}

const tools = ["move", "brush", "lasso", "box", "paint"];

it.each(sizes)("every option of every tool is reached at %d x %d", async (width, height) => {
  for (const one of [user, touching]) {
    await one.page.setViewportSize({ width, height });
    for (const tool of tools) {
      await one.ask(`app.view.set({ isSplit: false, isPanelOpen: false, tool: "${tool}" })`);
      await drawn(one);
      expect(await one.page.evaluate(outOfReach)).toEqual([]);
    }
  }
});

it.each(little)("the picture has more than half of a telephone of %d x %d, with the options open", async (width, height) => {
  for (const one of [user, touching]) {
    await one.page.setViewportSize({ width, height });
    for (const tool of tools) {
      await one.ask(`app.view.set({ isSplit: false, isPanelOpen: false, tool: "${tool}" })`);
      await drawn(one);
      const box = (await one.page.locator("canvas.stage").first().boundingBox())!;
      expect((box.width * box.height) / (width * height)).toBeGreaterThan(0.5);
    }
  }
});

const cases = [...sizes.map((size) => [...size, "a mouse"] as const), ...little.map((size) => [...size, "fingers"] as const)];

it.each(cases)("nothing covers anything at %d x %d under %s", async (width, height, pointer) => {
  const one = pointer === "fingers" ? touching : user;
  await one.page.setViewportSize({ width, height });
  await one.ask(`app.change({ ...window.__lpdeform.document(), secondP: 3 })`);
  const found: Record<string, string[]> = {};
  for (const state of states) {
    await one.ask(`app.view.set(${JSON.stringify(state)})`);
    await drawn(one);
    const all = await one.page.evaluate(faults, [parts, isLittle(width, height) ? beside : []]);
    if (all.length > 0) found[JSON.stringify(state)] = all;
  }
  expect(found).toEqual({});
});

it.each([
  [390, 844],
  [768, 1024],
  [844, 390],
])("two pictures are called as they stand at %d x %d, with the panel and without", async (width, height) => {
  await user.page.setViewportSize({ width, height });
  for (const isPanelOpen of [true, false, true]) {
    await user.ask(`app.view.set({ isSplit: true, isPanelOpen: ${isPanelOpen}, tool: "move" })`);
    await drawn(user);
    const [first, second] = await Promise.all([0, 1].map((k) => user.page.locator(".pane").nth(k).boundingBox()));
    const wanted = first!.y === second!.y ? ["left", "right"] : ["upper", "lower"];
    expect(await user.page.locator(".p-name small").allTextContents()).toEqual(wanted);
  }
});
