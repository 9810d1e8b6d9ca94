import { join } from "node:path";
import { afterAll, beforeAll, beforeEach, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { sizes } from "../support/sizes.js";
import { undrawn, User } from "./user.js";

// At every size, nothing that is pressed or read covers anything else.

let service: Service;
let user: User;
/** The same page under fingers, where what is pressed is larger. */
let touching: User;

async function openBoth() {
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`, { args: undrawn });
  await user.settled();
  touching = await User.open(`${service.url}/?shape=bar&detail=coarse`, { hasTouch: true, args: undrawn });
  await touching.settled();
}

async function closeBoth() {
  await user.close();
  await touching.close();
  expect([...user.errors, ...touching.errors]).toEqual([]);
}

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  await openBoth();
});

// A test is repeated only where the browser has stopped drawing (vitest.config.ts). It never draws again, so the test gets other ones.
beforeEach(async ({ task }) => {
  if (!task.result?.retryCount) return;
  await closeBoth();
  await openBoth();
});

afterAll(async () => {
  await closeBoth().finally(() => service.stop());
});

const states = [false, true].flatMap((isSplit) =>
  [false, true].flatMap((isPanelOpen) => (["move", "paint", "lasso"] as const).map((tool) => ({ isSplit, isPanelOpen, tool }))),
);

/** Where room is little, these leave the pictures free. */
const beside = [".topbar", ".rail", ".options", ".dock", ".panel", ".hint", ".legend", ".notice"];
const isTelephone = (width: number, height: number) => (width <= 720 && width <= height) || (height <= 560 && height <= width);
const isLittle = (width: number, height: number) =>
  isTelephone(width, height) || (width <= 900 && height <= 900) || (width <= 1150 && height <= 600);
const little = sizes.filter(([width, height]) => isTelephone(width, height));

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
  ".restored",
  ".aside",
  ".better",
  ".panel",
];

/** All that the page can have to say at once. */
const messages = {
  setAside: [
    { id: 1, name: "bar" },
    { id: 2, name: "a model with a long name.glb" },
  ],
  better: [0.07, 0.12],
  notice: {
    text: "my tube.glb: 221 vertices, 17 of them copies along seams, welded: the panel “Mesh” has a switch. Shown with z up, as it seems: “Y is up” in the panel turns it.",
    isBad: true,
    stays: true,
  },
  status: { kind: "away", title: "The server is away", text: "Your work is kept here. Reconnecting by itself…", element: "" },
};
/** Of a file whose name has no blank, and so long that no picture is left where nothing limits it. */
const longNotice = {
  ...messages.notice,
  text: `${"a_name_".repeat(9)}.glb: 12,221 vertices, 317 of them copies along seams, welded: the panel “Mesh” has a switch. 12 parts of it stay as they are: the panel “Mesh” names them. Where 28 vertices of its borders lie near others it comes apart, unless “Weld within” in the panel “Mesh” joins them. Shown with z up, as it seems: “Y is up” in the panel turns it.`,
};
const nothingSaid = { setAside: [], better: [] };

/** Pairs that overlap by more than a pixel of rounding, and what is cut off by the window. */
function faults([parts, beside]: readonly (readonly string[])[]): string[] {
  /** Of messages, those that are scrolled out of their part of the page are not seen. */
  const seen = (element: HTMLElement) => {
    const { left, right, top, bottom } = element.getBoundingClientRect();
    const isFixed = getComputedStyle(element).position === "fixed";
    const within = isFixed ? undefined : element.closest(".messages")?.getBoundingClientRect();
    const [highest, lowest] = [Math.max(top, within?.top ?? top), Math.min(bottom, within?.bottom ?? bottom)];
    return { left, right, top: highest, bottom: lowest, width: right - left, height: Math.max(lowest - highest, 0) };
  };
  const boxes = [".pane", ...parts!].flatMap((part) =>
    [...document.querySelectorAll<HTMLElement>(part)]
      .map((element) => ({ part, element, box: seen(element) }))
      .filter(({ element, box }) => box.width * box.height > 0 && element.checkVisibility({ visibilityProperty: true })),
  );
  const found: string[] = [];
  boxes.forEach(({ part, box, element }, k) => {
    if (box.left < -1 || box.top < -1 || box.right > innerWidth + 1 || box.bottom > innerHeight + 1)
      found.push(`${part} is cut off`);
    if (part === ".notice") {
      const words = document.createRange();
      words.selectNodeContents(element);
      const { left, right } = words.getBoundingClientRect();
      if (left < box.left - 1 || right > box.right + 1) found.push("words of the notice are cut off");
    }
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

/** By how much what stands over the pictures covers the shape that has just been opened, by name. */
function covering(): string[] {
  const { app, vertexOnPage } = (window as any).__lpdeform;
  const count = app.mesh.positions.length / 3;
  const found: string[] = [];
  [...document.querySelectorAll(".pane")].forEach((element, k) => {
    const places: { x: number; y: number }[] = Array.from({ length: count }, (_, vertex) => vertexOnPage(vertex, k));
    const shape = {
      left: Math.min(...places.map(({ x }) => x)),
      right: Math.max(...places.map(({ x }) => x)),
      top: Math.min(...places.map(({ y }) => y)),
      bottom: Math.max(...places.map(({ y }) => y)),
    };
    const pane = element.getBoundingClientRect();
    if (Math.max(shape.bottom - shape.top, shape.right - shape.left) < 0.2 * pane.height)
      found.push(`the shape is small in ${k}`);
    if (shape.left < pane.left || shape.right > pane.right || shape.top < pane.top || shape.bottom > pane.bottom)
      found.push(`the shape is cut off in ${k}`);
    for (const part of document.querySelectorAll(
      ".notice, .hint, .legend, .pill, .rail, .options, .dock, .split ~ .dock > *",
    )) {
      const box = part.getBoundingClientRect();
      const within = (place: { x: number; y: number }) =>
        place.x > box.left && place.x < box.right && place.y > box.top && place.y < box.bottom;
      const covered = places.filter(within).length;
      if (covered > 0) found.push(`${part.className} covers ${covered} of ${count} vertices in ${k}`);
    }
  });
  return found;
}

/** Messages whose shadows end before the window does. */
function cutShadows(): string[] {
  const blur = 28;
  const { left, right } = document.querySelector(".messages")!.getBoundingClientRect();
  return [...document.querySelectorAll<HTMLElement>(".banner, .restored, .aside, .better")].flatMap((element) => {
    const box = element.getBoundingClientRect();
    const isWhole = left <= Math.max(box.left - blur, 0) && right >= Math.min(box.right + blur, innerWidth);
    return isWhole ? [] : [`the shadow of ${element.className} is cut off`];
  });
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

it.each(sizes)(
  "nothing covers the first shape at %d x %d, in one picture or two, and the hint is there",
  async (width, height) => {
    await user.page.setViewportSize({ width, height });
    const found: Record<string, string[]> = {};
    for (const shape of ["bar", "creature", "sheet"]) {
      await user.ask("app.view.set({ isSplit: false, isPanelOpen: false, tool: 'move' })");
      await user.ask(`app.startOver("${shape}", "coarse")`);
      await user.until(`!document.querySelector(".hint").hidden`);
      for (const isSplit of shape === "creature" ? [false, true] : [false]) {
        await user.ask(`app.view.set({ isSplit: ${isSplit} })`);
        await user.until("window.__lpdeform.app.panes.every(({ stage }) => stage.surface)");
        await user.drawn();
        const all = await user.page.evaluate(covering);
        if (all.length > 0) found[`${shape}, ${isSplit ? "two pictures" : "one"}`] = all;
      }
    }
    expect(found).toEqual({});
  },
);

/** As it is opened, with the move tool. */
async function showCreature(isSplit: boolean, isPanelOpen: boolean): Promise<void> {
  await user.ask(`app.view.set({ isSplit: ${isSplit}, isPanelOpen: ${isPanelOpen}, tool: "move" })`);
  await user.ask(`app.startOver("creature", "coarse")`);
  await user.until("window.__lpdeform.app.panes.every(({ stage }) => stage.surface)");
  await user.drawn();
}

it.each(sizes)(
  "the options of a tool that is taken cover no shape at %d x %d, as long as nobody has turned the view",
  async (width, height) => {
    await user.page.setViewportSize({ width, height });
    const found: Record<string, string[]> = {};
    for (const isPanelOpen of [false, true]) {
      for (const isSplit of [false, true]) {
        await showCreature(isSplit, isPanelOpen);
        await user.ask(`app.view.set({ tool: "paint" })`);
        await user.drawn();
        const all = (await user.page.evaluate(covering)).filter((fault) => !fault.includes("is small"));
        if (all.length > 0) found[`${isSplit ? "two pictures" : "one"}, panel ${isPanelOpen ? "open" : "closed"}`] = all;
      }
    }
    expect(found).toEqual({});
  },
);

it.each(sizes)(
  "a notice covers neither the shape nor a control at %d x %d, with the panel and without",
  async (width, height) => {
    await user.page.setViewportSize({ width, height });
    const found: Record<string, string[]> = {};
    for (const isPanelOpen of [false, true]) {
      for (const isSplit of [false, true]) {
        await showCreature(isSplit, isPanelOpen);
        const { notice } = messages;
        await user.page.evaluate(([notice]) => (window as any).__lpdeform.app.facts.set({ notice }), [notice]);
        await user.drawn();
        const all = [
          ...(await user.page.evaluate(covering)),
          ...(await user.page.evaluate(faults, [parts, isLittle(width, height) ? beside : []])),
        ];
        if (all.length > 0) found[`${isSplit ? "two pictures" : "one"}, panel ${isPanelOpen ? "open" : "closed"}`] = all;
        await user.ask("app.facts.set({ notice: undefined })");
      }
    }
    expect(found).toEqual({});
  },
);

it.each(sizes)(
  "a long notice with a long name has its words within it, and leaves the picture room, at %d x %d",
  async (width, height) => {
    await user.page.setViewportSize({ width, height });
    const found: Record<string, string[]> = {};
    for (const isPanelOpen of [false, true]) {
      await user.ask(`app.view.set({ isSplit: false, isPanelOpen: ${isPanelOpen}, tool: "move" })`);
      await user.drawn();
      const room = async () => (await user.page.locator("canvas.stage").boundingBox())!.height;
      const before = await room();
      await user.page.evaluate(([notice]) => (window as any).__lpdeform.app.facts.set({ notice }), [longNotice]);
      await user.drawn();
      const all = await user.page.evaluate(faults, [parts, isLittle(width, height) ? beside : []]);
      if ((await room()) < 0.55 * before) all.push(`the picture is ${await room()} px high, without a notice ${before}`);
      if (all.length > 0) found[`panel ${isPanelOpen ? "open" : "closed"}`] = all;
      await user.ask("app.facts.set({ notice: undefined })");
    }
    expect(found).toEqual({});
  },
);

/** What of this part of the page cannot be pressed, if need be after it is scrolled into sight, by name. */
function outOfReach(part: string): string[] {
  return [...document.querySelector(part)!.querySelectorAll<HTMLElement>("button, select, input")].flatMap((control) => {
    const pressed = control.closest<HTMLElement>("label") ?? control;
    if (!pressed.checkVisibility()) return [];
    if (part !== ".dock") pressed.scrollIntoView({ block: "center", inline: "center" });
    const { left, right, top, bottom } = pressed.getBoundingClientRect();
    const found = [left + 2, (left + right) / 2, right - 2].map((x) => document.elementFromPoint(x, (top + bottom) / 2));
    return found.every((element) => pressed.contains(element)) ? [] : [control.ariaLabel ?? control.textContent];
  });
}

const tools = ["move", "brush", "lasso", "box", "paint"];

it.each(sizes)("every option of every tool, the menu and the panel are reached at %d x %d", async (width, height) => {
  const one = isLittle(width, height) ? touching : user;
  await one.page.setViewportSize({ width, height });
  for (const tool of tools) {
    await one.ask(`app.view.set({ isSplit: false, isPanelOpen: false, tool: "${tool}" })`);
    await one.drawn();
    expect(await one.page.evaluate(outOfReach, ".options")).toEqual([]);
  }
  await one.page.getByRole("button", { name: "Save" }).click();
  expect(await one.page.evaluate(outOfReach, ".menu")).toEqual([]);
  await one.page.keyboard.press("Escape");
  await one.ask("app.view.set({ isPanelOpen: true })");
  await one.page.evaluate("document.querySelectorAll('.panel details').forEach((one) => (one.open = true))");
  expect(await one.page.evaluate(outOfReach, ".panel")).toEqual([]);
});

const cases = [...sizes.map((size) => [...size, "a mouse"] as const), ...little.map((size) => [...size, "fingers"] as const)];

it.each(cases)("what the dock has is pressed where it is seen at %d x %d under %s", async (width, height, pointer) => {
  const one = pointer === "fingers" ? touching : user;
  await one.page.setViewportSize({ width, height });
  for (const isSplit of [false, true]) {
    for (const isPanelOpen of [false, true]) {
      await one.ask(`app.view.set({ isSplit: ${isSplit}, isPanelOpen: ${isPanelOpen}, tool: "move" })`);
      await one.drawn();
      expect(await one.page.evaluate(outOfReach, ".dock")).toEqual([]);
    }
  }
});

it.each(little)("the picture has more than half of a telephone of %d x %d, with the options open", async (width, height) => {
  for (const one of [user, touching]) {
    await one.page.setViewportSize({ width, height });
    for (const tool of tools) {
      await one.ask(`app.view.set({ isSplit: false, isPanelOpen: false, tool: "${tool}" })`);
      await one.drawn();
      const box = (await one.page.locator("canvas.stage").first().boundingBox())!;
      expect((box.width * box.height) / (width * height)).toBeGreaterThan(0.5);
    }
  }
});

it.each(cases)("nothing covers anything at %d x %d under %s", async (width, height, pointer) => {
  const one = pointer === "fingers" ? touching : user;
  await one.page.setViewportSize({ width, height });
  await one.ask(`app.change({ ...window.__lpdeform.document(), secondP: 3 })`);
  const found: Record<string, string[]> = {};
  for (const state of pointer === "fingers" ? states.filter(({ tool }) => tool === "paint") : states) {
    await one.ask(`app.view.set(${JSON.stringify(state)})`);
    await one.drawn();
    const all = await one.page.evaluate(faults, [parts, isLittle(width, height) ? beside : []]);
    if (all.length > 0) found[JSON.stringify(state)] = all;
  }
  const before = await one.ask("app.facts.now.status");
  // A message of the server would replace the texts that are shown here.
  await one.page.evaluate(`{
    const { watcher } = window.__lpdeform.app.panes[0];
    window.told = { ...watcher };
    watcher.status = watcher.notice = watcher.problem = watcher.better = () => undefined;
  }`);
  for (const isPanelOpen of [false, true]) {
    await one.ask(`app.view.set({ isSplit: false, isPanelOpen: ${isPanelOpen}, tool: "move" })`);
    await one.page.evaluate(
      ([messages]) => (window as any).__lpdeform.app.facts.set({ ...(messages as object), restoredFrom: Date.now() }),
      [messages],
    );
    await one.page.locator(".banner").waitFor();
    await one.drawn();
    const all = [
      ...(await one.page.evaluate(faults, [parts, isLittle(width, height) ? [".notice"] : []])),
      ...(await one.page.evaluate(cutShadows)),
    ];
    if (all.length > 0) found[`all messages, panel ${isPanelOpen ? "open" : "closed"}`] = all;
    await one.page.evaluate(
      ([nothing, status]) =>
        (window as any).__lpdeform.app.facts.set({
          ...(nothing as object),
          notice: undefined,
          restoredFrom: undefined,
          status,
        }),
      [nothingSaid, before],
    );
  }
  await one.page.evaluate("void Object.assign(window.__lpdeform.app.panes[0].watcher, window.told)");
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
    await user.drawn();
    const [first, second] = await Promise.all([0, 1].map((k) => user.page.locator(".pane").nth(k).boundingBox()));
    const wanted = first!.y === second!.y ? ["left", "right"] : ["upper", "lower"];
    expect(await user.page.locator(".p-name small").allTextContents()).toEqual(wanted);
  }
});

it("a picture keeps its size while it is pressed, whatever is said meanwhile", async () => {
  await user.page.setViewportSize({ width: 390, height: 844 });
  await user.ask(`app.view.set({ isSplit: false, isPanelOpen: false, tool: "move" })`);
  const height = async () => (await user.drawn(), (await user.page.locator("canvas.stage").boundingBox())!.height);
  const say = (isBad: boolean) =>
    user.page.evaluate(([text, isBad]) => (window as any).__lpdeform.app.facts.set({ notice: { text, isBad } }), [
      messages.notice.text,
      isBad,
    ] as const);
  const alone = await height();
  await say(false);
  const beside = await height();
  expect(beside).toBeLessThan(alone);
  await user.page.mouse.move(40, 300);
  await user.page.mouse.down();
  expect(await user.page.locator(".notice").isVisible()).toBe(false);
  expect(await height()).toBe(beside);
  await user.page.mouse.up();
  expect(await height()).toBe(alone);
  await user.page.mouse.down();
  await say(true);
  expect(await height()).toBe(alone);
  await user.page.mouse.up();
  expect(await height()).toBe(beside);
  expect(await user.page.locator(".notice").isVisible()).toBe(true);
  await user.ask("app.facts.set({ notice: undefined })");
});

it("the shape is fitted again when the panel opens after the first drag", async () => {
  const fresh = await User.open(`${service.url}/?shape=creature&detail=coarse`, {
    width: 820,
    height: 1180,
    hasTouch: true,
    args: undrawn,
  });
  await fresh.settled();
  const [vertex] = await fresh.ask<number[]>(`document().handles.find(({ name }) => name === "Head").vertices`);
  await fresh.drag(await fresh.vertexOnPage(vertex!), -90, -60);
  await fresh.settled();
  await fresh.page.getByRole("button", { name: "Side panel" }).click();
  await fresh.drawn();
  expect(await fresh.page.evaluate(covering)).toEqual([]);
  await fresh.close();
});
