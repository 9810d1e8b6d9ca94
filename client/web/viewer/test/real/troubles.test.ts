import { join } from "node:path";
import { afterEach, describe, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { make3mf, makeDae, makeFbx } from "../made_foreign.js";
import { User } from "./user.js";

const files = join(import.meta.dirname, "../../dist");
const open: { stop(): Promise<void> }[] = [];

async function start(...serverFlags: string[]): Promise<Service> {
  const service = await Service.start({ files, serverFlags });
  open.push(service);
  return service;
}

async function visit(service: Service): Promise<User> {
  const user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  open.push({ stop: () => user.close() });
  return user;
}

afterEach(async () => {
  while (open.length > 0) await open.pop()!.stop();
});

/** What is said of a server or a proxy that has stopped: the second as soon as Envoy's checks of the server's health have failed. */
const stopped = /The server (does not answer|is away)/;

const banner = (user: User, words: string | RegExp, timeout = 30_000) =>
  user.page.locator(".banner", { hasText: words }).waitFor({ timeout });

/**
 * Starts a clock in the page that goes on by a tenth of a second at most while the page does not get the processor, which it shares with
 * other tests, and stops when the banner says this. The returned function tells how many milliseconds it shows.
 */
async function startClock({ page }: User, until: RegExp): Promise<() => Promise<number>> {
  await page.evaluate((text) => {
    const banner = document.querySelector<HTMLElement>(".banner")!;
    const clock = { shows: 0, ticked: performance.now() };
    Object.assign(window, { __clock: clock });
    const timer = setInterval(() => {
      const now = performance.now();
      clock.shows += Math.min(now - clock.ticked, 100);
      clock.ticked = now;
      if (!banner.hidden && new RegExp(text).test(banner.textContent)) clearInterval(timer);
    }, 10);
  }, until.source);
  return () => page.evaluate<number>("window.__clock.shows");
}

describe("the page says plainly, and goes on by itself when", () => {
  it("the server is full", async () => {
    // It asks for a pause until a session can expire, at most a minute.
    const service = await start("--max-sessions", "1", "--session-idle", "10");
    const first = await visit(service);
    await first.settled();
    const second = await visit(service);
    await banner(second, "The server is full");
    await first.ask("app.panes[0].live.close()");
    await second.settled();
    await second.page.locator(".banner").waitFor({ state: "hidden" });
  });

  it("the server shuts down, and another comes", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    const stopping = service.stopServer();
    await banner(user, "The server is shutting down");
    await stopping;
    await service.startServer();
    await user.settled();
    expect(await user.ask("document().handles.length")).toBe(2);
  });

  it("the server is killed, also while a handle is dragged", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    const { mouse } = user.page;
    const { x, y } = await user.vertexOnPage(await user.ask<number>("document().handles[1].vertices[0]"));
    await mouse.move(x, y);
    await mouse.down();
    await service.killServer();
    let isOver = false;
    const said = banner(user, "The server is away", 20_000).finally(() => (isOver = true));
    for (let k = 0; !isOver; ++k) await mouse.move(x + 60 * Math.sin(k / 20), y + 5); // each changes what the page tells of
    await said;
    expect(await user.page.locator(".pill").textContent()).toBe("The server is away");
    await service.startServer();
    await mouse.up();
    await user.settled();
    await user.page.locator(".banner").waitFor({ state: "hidden" });
  });

  it.each(["server", "envoy"] as const)("the %s is stopped, within two seconds, also during a drag", async (part) => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    const { mouse } = user.page;
    const { x, y } = await user.vertexOnPage(await user.ask<number>("document().handles[1].vertices[0]"));
    for (const isDragging of [false, true]) {
      if (isDragging) {
        await mouse.move(x, y);
        await mouse.down();
      }
      const clock = await startClock(user, stopped);
      service.pause(part);
      let isOver = false;
      const said = banner(user, stopped, 20_000).finally(() => (isOver = true));
      for (let k = 0; isDragging && !isOver; ++k) await mouse.move(x + 60 * Math.sin(k / 20), y + 5);
      await said;
      expect(await clock()).toBeLessThan(2000);
      await user.page.waitForTimeout(1000); // and it stays
      expect(await user.page.locator(".banner", { hasText: stopped }).isVisible()).toBe(true);
      expect(await user.page.locator(".pill").textContent()).toMatch(stopped);
      service.resume(part);
      await mouse.up();
      await user.page.locator(".banner").waitFor({ state: "hidden" });
      await user.settled();
    }
  });

  it("a change is refused, also where that is said as the drag ends", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.ask(`app.during({ ...window.__lpdeform.document(), p: 3 }, 0)`);
    await user.ask(`app.facts.set({ problem: { reason: "P_OUT_OF_RANGE", message: "no", element: "" } })`);
    await user.ask("app.endGesture()");
    await banner(user, "The server cannot take this change");
    await user.ask(`app.change({ ...window.__lpdeform.document(), p: 2 })`);
    await user.page.locator(".banner").waitFor({ state: "hidden" });
  });

  it("the page itself fails with every frame: it stops after some tries, and tries again when it is told to", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.page.evaluate(() => {
      const { watcher } = (window as any).__lpdeform.app.panes[0].live;
      const { frame } = watcher;
      watcher.frame = () => {
        throw new RangeError("Array buffer allocation failed");
      };
      Object.assign(window, { mend: () => (watcher.frame = frame) });
    });
    await user.ask(`app.change({ ...window.__lpdeform.document(), p: 3 })`);
    await banner(user, "This page fails with every frame");
    expect(await user.page.locator(".banner").textContent()).toContain("RangeError: Array buffer allocation failed.");
    await user.page.evaluate("mend()");
    await user.page.locator(".banner").getByRole("button", { name: "Try again" }).click();
    await user.settled();
    await user.page.locator(".banner").waitFor({ state: "hidden" });
    expect(user.errors).toEqual([]);
  });

  it("there is no server yet", async () => {
    const service = await start();
    await service.killServer();
    const user = await visit(service);
    await banner(user, "The server is away");
    await service.startServer();
    await user.settled();
    expect(user.errors).toEqual([]);
  });

  it("the server refuses a mesh, and takes the next", async () => {
    const service = await start("--max-vertices", "500");
    const user = await visit(service);
    await user.settled();
    await user.page.getByLabel("Detail").selectOption("fine");
    await banner(user, "The server refuses this mesh");
    expect(await user.page.locator(".banner").textContent()).toContain("500");
    await user.page.getByLabel("Detail").selectOption("coarse");
    await user.settled();
    await user.page.locator(".banner").waitFor({ state: "hidden" });
  });
});

describe("the page's policy", () => {
  it("lets it do all it does, and nobody frame it", async () => {
    const service = await start();
    const user = await visit(service);
    const context = await user.browser.newContext({ viewport: { width: 1280, height: 800 } });
    const page = await context.newPage();
    const said: string[] = [];
    page.on("console", (message) => message.type() === "error" && said.push(message.text()));
    page.on("pageerror", ({ message }) => said.push(message));
    const answer = await page.goto(`${service.url}/?shape=bar&detail=coarse&encoding=compressed`);
    expect(answer!.headers()["content-security-policy"]).toContain("default-src 'none'");
    await page.locator('.pill[data-kind="live"]').waitFor();
    await page.locator('[data-measure="stop"]', { hasText: "converged" }).waitFor();
    await page.getByRole("button", { name: "Save" }).click();
    const download = page.waitForEvent("download");
    await page.getByRole("menuitem", { name: "Picture as PNG" }).click();
    await download;
    expect(await page.locator(".stops .stop").nth(1).getAttribute("style")).toContain("--share");
    const asked: string[] = [];
    page.on("request", (request) => asked.push(request.url()));
    for (const [name, content] of Object.entries({ "a.fbx": makeFbx(), "a.dae": makeDae(), "a.3mf": make3mf() })) {
      const chooser = page.waitForEvent("filechooser");
      await page.getByRole("button", { name: "Open" }).click();
      await (await chooser).setFiles([{ name, mimeType: "application/octet-stream", buffer: Buffer.from(content) }]);
      await page.locator(".notice", { hasText: `${name} is opened as a.glb.` }).waitFor();
    }
    expect(asked.join()).toMatch(/foreign_worker/);
    expect(asked.join()).not.toMatch(/foreign_glb/); // the page itself reads none
    expect(said).toEqual([]);

    const framing = await context.newPage();
    const refusal = framing.waitForEvent("console", (message) => message.text().includes("frame-ancestors"));
    await framing.setContent(`<iframe src="${service.url}/"></iframe>`);
    await refusal;
  });
});

const refuseWebGl = `{
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
  };
}`;

describe("where pictures", () => {
  it("cannot be drawn, the page says so", async () => {
    const service = await start();
    const user = await visit(service);
    const context = await user.browser.newContext();
    await context.addInitScript(refuseWebGl);
    const page = await context.newPage();
    const errors: string[] = [];
    page.on("pageerror", ({ message }) => errors.push(message));
    await page.goto(user.page.url());
    await page.getByRole("alert").filter({ hasText: "This browser does not draw in three dimensions" }).waitFor();
    expect(errors).toEqual([]);
  });

  it("are refused to a second pane, the first goes on", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.page.evaluate(refuseWebGl);
    await user.page.keyboard.press("s");
    await user.page.getByText("This browser draws no second picture").waitFor();
    expect(await user.ask("app.panes.length")).toBe(1);
    expect(await user.ask("app.view.now.isSplit")).toBe(false);
    const before = await user.ask<number>("app.panes[0].frame.inputSeq");
    await user.page.keyboard.press("ArrowRight");
    await user.until(`window.__lpdeform.app.panes[0].frame.inputSeq > ${before}`);
    expect(user.errors).toEqual([]);
  });

  it("are lost by the browser, they come again", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.page.keyboard.press("c"); // the colours of p: blue throughout
    await user.page.waitForTimeout(500);
    const { coloured } = await user.colours();
    await user.page.evaluate(`{
      const context = document.querySelector("canvas.stage").getContext("webgl2");
      const extension = context.getExtension("WEBGL_lose_context");
      window.__restore = () => extension.restoreContext();
      extension.loseContext();
    }`);
    await user.page.waitForTimeout(300);
    expect((await user.colours()).coloured).toBeLessThan(coloured / 2);
    await user.page.evaluate("window.__restore()");
    await user.page.waitForTimeout(800);
    expect((await user.colours()).coloured).toBeGreaterThan(0.95 * coloured);
    expect(user.errors).toEqual([]);
  });
});

describe("a mesh with defects", () => {
  // A tetrahedron, a third face on one of its edges, a face without area, a vertex that nothing uses.
  const off =
    "OFF\n7 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n5 5 5\n0.5 0 0\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n3 1 2 4\n3 0 6 1\n";

  it("is told as warnings, and each points out its elements", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.openFiles({ name: "odd.off", content: off });
    const pointedOut = () => user.ask<{ vertices: number[]; edges: number[]; faces: number[] }>("app.facts.now.pointedOut");
    // In the colour of marks on light pages, or nearly.
    const expectMarked = async (place: readonly number[]) => {
      await expect
        .poll(
          async () => {
            const [r, g, b] = await user.colourAt(await user.ask(`pointOnPage([${place.join()}])`));
            return r > 120 && g < 90 && b > 60;
          },
          { timeout: 30_000 },
        )
        .toBe(true);
    };
    const warnings = user.page.locator(".warnings button");
    await warnings.first().waitFor();
    const texts = await warnings.allTextContents();
    expect(texts.join("; ")).toMatch(/1 unreferenced vertex.*2 non-manifold edges/);
    await user.page.locator('[data-warning="unreferenced_vertices"]').click();
    expect(await pointedOut()).toEqual({ vertices: [5], edges: [], faces: [] });
    await user.page.locator('[data-warning="zero_area_faces"]').click();
    expect(await pointedOut()).toEqual({ vertices: [], edges: [], faces: [5] });
    await expectMarked([0.3, 0, 0]); // a side of it: it has no area
    await user.page.locator('[data-warning="non_manifold_edges"]').click();
    expect((await pointedOut()).edges).toEqual(expect.arrayContaining([1, 2]));
    await expectMarked([0.5, 0.5, 0]);
    await user.ask("app.facts.set({ pointedOut: { vertices: [], edges: [], faces: [2] } })");
    await expectMarked([1 / 3, 1 / 3, 1 / 3]);
    // What is marked comes into view.
    await user.page.locator("canvas.stage").hover();
    await user.page.mouse.wheel(0, -2000);
    await user.page.locator('[data-warning="unreferenced_vertices"]').click();
    const { position, target } = await user.ask<{ position: number[]; target: number[] }>("app.panes[0].stage.look");
    const distance = Math.hypot(...position.map((value, axis) => value - target[axis]!));
    const share = distance / (await user.ask<number>("app.diagonal"));
    expect([share > 1.5, share < 3.1]).toEqual([true, true]);
    const box = (await user.page.locator("canvas.stage").boundingBox())!;
    const { x, y } = await user.vertexOnPage(5);
    expect(Math.abs(x - (box.x + box.width / 2))).toBeLessThan(box.width / 4);
    expect(Math.abs(y - (box.y + box.height / 2))).toBeLessThan(box.height / 4);
    // And all of the surface with it, where that does not lie far away.
    await user.page.locator('[data-warning="non_manifold_edges"]').click();
    for (const corner of [0, 1, 2, 3, 4, 6]) {
      const place = await user.vertexOnPage(corner);
      expect([place.x > box.x, place.x < box.x + box.width]).toEqual([true, true]);
      expect([place.y > box.y, place.y < box.y + box.height]).toEqual([true, true]);
    }
  });

  it("or a change that is refused shows where, if what is named can be shown", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    const refuse = (element: string) =>
      user.ask(`app.facts.set({ problem: { reason: "COMPONENT_WITHOUT_HANDLE", message: "no", element: '${element}' } })`);
    const show = user.page.locator(".banner").getByRole("button", { name: "Show where" });
    await refuse("component 2"); // the number is not a vertex's
    await banner(user, "The server cannot take this change");
    expect(await show.isVisible()).toBe(false);
    await refuse("vertex 17");
    await show.click();
    expect(await user.ask("app.facts.now.pointedOut.vertices")).toEqual([17]);
    await refuse('handle "gone"');
    expect(await show.isVisible()).toBe(false);
    await refuse('handle "Top"');
    await show.click();
    const held = await user.ask<number[]>("document().handles.find(({ name }) => name === 'Top').vertices");
    expect(await user.ask("app.facts.now.pointedOut.vertices")).toEqual(held);
  });

  it("or a file that is no mesh is refused in words, and what was there stays", async () => {
    const service = await start();
    const user = await visit(service);
    await user.settled();
    await user.openFiles({ name: "bad.off", content: "OFF\n3 1 0\n0 0 0\n" });
    await user.page.locator(".notice.bad", { hasText: "bad.off ends before vertex 1." }).waitFor();
    await user.openFiles({ name: "bad.json", content: '{"handles": [{"name": "a", "vertices": [99999]}]}' });
    await user.page.locator(".notice.bad", { hasText: "vertex 99999" }).waitFor();
    expect(await user.ask("app.mesh.name")).toBe("bar");
    expect(await user.ask("document().handles.length")).toBe(2);
    expect(user.errors).toEqual([]);
  });
});
