import { type Browser, chromium, type Download, type Page } from "playwright-core";
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

/** Debian's Chromium, drawing in software, pages too, as it does on machines without a GPU: the same on every machine. */
export const launch = {
  executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
  args: [
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--no-sandbox",
  ],
};

/** For tests that do not look at the pictures: nothing is drawn in them, which takes most of the time. */
export const undrawn = [...launch.args, "--disable-gl-drawing-for-tests"];

export interface FrameFacts {
  inputSeq: number;
  isFinal: boolean;
  energy: number;
  stopReason: string;
  epoch: number;
  iteration: number;
  isSettling: boolean;
  gap: number | undefined;
}

export interface MeterFacts {
  inputs: number;
  p50: number;
  p99: number;
  service50: number;
  service99: number;
  framesPerSecond: number;
  bytesPerSecond: number;
}

/** Somebody before the page. */
export class User {
  readonly errors: string[] = [];

  private constructor(
    readonly browser: Browser,
    readonly page: Page,
  ) {
    page.on("pageerror", (error) => this.errors.push(error.message));
  }

  static async open(
    url: string,
    { width = 1280, height = 800, hasTouch = false, colorScheme = "light" as "light" | "dark", args = launch.args } = {},
  ): Promise<User> {
    const browser = await chromium.launch({ ...launch, args });
    // What the tests ask of the page is evaluated, which its policy forbids; troubles.test.ts keeps the policy.
    const context = await browser.newContext({
      viewport: { width, height },
      hasTouch,
      colorScheme,
      acceptDownloads: true,
      bypassCSP: true,
    });
    const user = new User(browser, await context.newPage());
    await user.page.goto(url);
    return user;
  }

  close(): Promise<void> {
    return this.browser.close();
  }

  /** Of the page's test interface. */
  ask<Value>(what: string): Promise<Value> {
    return this.page.evaluate(`window.__lpdeform.${what}`) as Promise<Value>;
  }

  frame(pane = 0): Promise<FrameFacts | undefined> {
    return this.ask(`frame(${pane})`);
  }

  positions(pane = 0): Promise<number[]> {
    return this.ask(`positions(${pane})`);
  }

  async until(what: string, timeout = 60_000): Promise<void> {
    await this.page.waitForFunction(what, undefined, { timeout, polling: 50 });
  }

  /** Until the result of all that was done so far is on the screen. */
  settled(pane = 0): Promise<void> {
    return this.until(`(() => {
      const facts = window.__lpdeform?.frame(${pane});
      return facts && facts.isFinal && !facts.isSettling && window.__lpdeform.status() === "live";
    })()`);
  }

  /** Until another frame was drawn, which shows what was done before. */
  drawn(): Promise<void> {
    return this.page.evaluate(
      () =>
        new Promise<void>((done, failed) => {
          requestAnimationFrame(() => requestAnimationFrame(() => done()));
          setTimeout(() => failed(new Error("the page answers, but drew nothing for 60 s")), 60_000);
        }),
    );
  }

  vertexOnPage(vertex: number, pane = 0): Promise<{ x: number; y: number }> {
    return this.ask(`vertexOnPage(${vertex}, ${pane})`);
  }

  /** The vertex whose place at rest is nearest. */
  async vertexNear(point: readonly [number, number, number]): Promise<number> {
    const rest = Object.values(await this.ask<Record<string, number>>("app.mesh.positions"));
    const far = (vertex: number) => Math.hypot(...point.map((value, axis) => rest[3 * vertex + axis]! - value));
    return Array.from({ length: rest.length / 3 }, (_, vertex) => vertex).reduce((best, one) =>
      far(one) < far(best) ? one : best,
    );
  }

  /** Drags from there by that many pixels, in steps, and lets go. */
  async drag(from: { x: number; y: number }, dx: number, dy: number, steps = 12): Promise<void> {
    const { mouse } = this.page;
    await mouse.move(from.x, from.y);
    await mouse.down();
    for (let step = 1; step <= steps; ++step) await mouse.move(from.x + (dx * step) / steps, from.y + (dy * step) / steps);
    await mouse.up();
  }

  /** Lets go of these files over the page, as a file manager does. */
  async drop(...files: string[]): Promise<void> {
    const devtools = await this.page.context().newCDPSession(this.page);
    const invitation = this.page.getByText("Drop a mesh, a project or a handle file");
    for (const type of ["dragEnter", "dragOver", "drop"] as const) {
      await devtools.send("Input.dispatchDragEvent", {
        type,
        x: 500,
        y: 400,
        data: { items: [], files, dragOperationsMask: 1 },
      });
      if (type === "dragOver") await invitation.waitFor();
    }
    await devtools.detach();
    await invitation.waitFor({ state: "hidden" });
  }

  async openFiles(...files: { name: string; content: string | Buffer }[]): Promise<void> {
    const chooser = this.page.waitForEvent("filechooser");
    await this.page.getByRole("button", { name: "Open" }).click();
    const payload = files.map(({ name, content }) => ({
      name,
      mimeType: "application/octet-stream",
      buffer: Buffer.from(content),
    }));
    await (await chooser).setFiles(payload);
  }

  /**
   * Opens a mesh or a project and waits until it is there. What is open before may have the same name and the same handles,
   * so that these do not say when.
   */
  async openInstead(...files: { name: string; content: string | Buffer }[]): Promise<void> {
    const before = await this.page.evaluateHandle("window.__lpdeform.app.mesh");
    await this.openFiles(...files);
    const isOther = (mesh: unknown) => (window as any).__lpdeform.app.mesh !== mesh;
    await this.page.waitForFunction(isOther, before, { timeout: 60_000, polling: 50 });
    await before.dispose();
  }

  /** Waits until the handles of an opened file are there, whose last has this name, and the page shows their result. */
  async handlesCame(last: string): Promise<void> {
    await this.until(`window.__lpdeform.document().handles.at(-1)?.name === ${JSON.stringify(last)}`);
    await this.settled();
  }

  async save(entry: string): Promise<Buffer> {
    await this.page.getByRole("button", { name: "Save" }).click();
    return await this.downloaded(() => this.page.getByRole("menuitem", { name: entry }).click());
  }

  /** The file that is saved when this is done. */
  async downloaded(act: () => Promise<void>): Promise<Buffer> {
    const download = this.page.waitForEvent("download", { timeout: 60_000 });
    await act();
    return readFileSync(await ((await download) as Download).path());
  }

  /** Red, green and blue of a place on the page. */
  async colourAt({ x, y }: { x: number; y: number }): Promise<[number, number, number]> {
    const png = await this.page.screenshot({ clip: { x: Math.floor(x), y: Math.floor(y), width: 1, height: 1 }, scale: "css" });
    const [r, g, b] = decodePng(png).pixels;
    return [r!, g!, b!];
  }

  /** What of the surface has colours that mean much distortion (yellow to red) and little (blue), in shares of the coloured. */
  async colours(): Promise<{ warm: number; cold: number; coloured: number }> {
    const box = await this.page.locator("canvas.stage").first().boundingBox();
    const withRest = await this.#drawSurfaceAlone();
    const style = "#app > :not(.stages), .pane > :not(canvas) { visibility: hidden !important; }";
    const png = await this.page.screenshot({ clip: box!, scale: "css", style });
    await withRest();
    const { pixels, channels } = decodePng(png);
    let [warm, cold, coloured] = [0, 0, 0];
    for (let at = 0; at < pixels.length; at += channels) {
      const [r, g, b] = [pixels[at]!, pixels[at + 1]!, pixels[at + 2]!];
      if (Math.max(r, g, b) - Math.min(r, g, b) < 70) continue;
      ++coloured;
      if (r > b + 60) ++warm;
      if (b > r + 60) ++cold;
    }
    return { warm: warm / coloured, cold: cold / coloured, coloured };
  }

  /** In the first picture, until the returned function is called: handles and arrows have colours of their own. */
  async #drawSurfaceAlone(): Promise<() => Promise<void>> {
    const rest = await this.page.evaluateHandle(() => {
      const { stage } = (window as any).__lpdeform.app.panes[0];
      const objects = [stage.marks, stage.pointed, stage.highlight, stage.gizmo].map(({ object }) => object);
      const scene = objects[0].parent;
      scene.remove(...objects);
      stage.resize(stage.width, stage.height, false);
      stage.draw();
      return { scene, objects };
    });
    return () =>
      rest.evaluate(({ scene, objects }) => {
        const { app } = (window as any).__lpdeform;
        scene.add(...objects);
        app.panes[0].invalidate();
        app.requestDraw();
      });
  }
}

/** Eight bits a channel, not interlaced: what a screenshot is. */
export function decodePng(png: Buffer): { pixels: Uint8Array; channels: number; width: number; height: number } {
  const width = png.readUInt32BE(16);
  const height = png.readUInt32BE(20);
  const channels = png[25] === 6 ? 4 : 3;
  const parts: Buffer[] = [];
  for (let at = 8; at < png.length;) {
    const length = png.readUInt32BE(at);
    if (png.toString("latin1", at + 4, at + 8) === "IDAT") parts.push(png.subarray(at + 8, at + 8 + length));
    at += length + 12;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = width * channels;
  const pixels = new Uint8Array(stride * height);
  for (let row = 0; row < height; ++row) {
    const filter = raw[row * (stride + 1)]!;
    for (let k = 0; k < stride; ++k) {
      const at = row * stride + k;
      const left = k >= channels ? pixels[at - channels]! : 0;
      const up = row > 0 ? pixels[at - stride]! : 0;
      const corner = k >= channels && row > 0 ? pixels[at - stride - channels]! : 0;
      pixels[at] = raw[row * (stride + 1) + 1 + k]! + predicted(filter, left, up, corner);
    }
  }
  return { pixels, channels, width, height };
}

function predicted(filter: number, left: number, up: number, corner: number): number {
  if (filter === 1) return left;
  if (filter === 2) return up;
  if (filter === 3) return (left + up) >> 1;
  if (filter !== 4) return 0;
  const guess = left + up - corner;
  const [a, b, c] = [Math.abs(guess - left), Math.abs(guess - up), Math.abs(guess - corner)];
  return a <= b && a <= c ? left : b <= c ? up : corner;
}
