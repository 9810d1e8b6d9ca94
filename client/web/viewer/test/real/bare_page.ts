import { writeFileSync } from "node:fs";
import type { Browser, CDPSession } from "playwright-core";
import { launch } from "./user.js";

/** The processor draws here, but in a process of its own, as a graphics card would: the page does not wait for its pictures. */
export const args = launch.args.filter((flag) => flag !== "--disable-gpu-compositing");

/** Where the button is that opens files. */
const openButton = `(({ x, y, width, height }) => ({ x: x + width / 2, y: y + height / 2 }))(
  [...document.querySelectorAll("button")].find((one) => /^Open/.test(one.getAttribute("aria-label") ?? one.textContent.trim()))
    .getBoundingClientRect())`;

/**
 * Moves the pressed pointer for some time. The next move comes 16 ms after the page has had the last one; `isSteady`: every 8 ms, as from
 * a mouse, whatever the page does.
 */
export async function stir(
  page: BarePage,
  { x, y }: { x: number; y: number },
  seconds: number,
  isSteady = false,
): Promise<void> {
  const begin = performance.now();
  const moves: Promise<void>[] = [];
  for (let now = 0; now < 1000 * seconds; now = performance.now() - begin) {
    const move = page.mouse("mouseMoved", x + 60 * Math.sin(now / 500), y + 25 * (1 - Math.cos(now / 400)), true);
    moves.push(move);
    if (!isSteady) await move;
    await new Promise((again) => setTimeout(again, isSteady ? 8 : 16));
  }
  await Promise.all(moves);
}

interface Reply {
  id?: number;
  method?: string;
  params?: Record<string, unknown>;
  result?: Record<string, unknown>;
  error?: { message: string };
}

/**
 * A page that nobody looks into but by what is asked here. Playwright copies the bytes of each request of its own pages, and searches
 * them by their roles, on their main threads, which takes longer than what is measured.
 */
export class BarePage {
  #lastId = 0;
  readonly #waiting = new Map<number, (reply: Reply) => void>();
  readonly #events = new Map<string, (params: Record<string, unknown>) => void>();

  private constructor(
    readonly root: CDPSession,
    readonly sessionId: string,
    readonly targetId: string,
  ) {
    root.on("Target.receivedMessageFromTarget", ({ sessionId: from, message }) => {
      if (from !== sessionId) return;
      const reply = JSON.parse(message) as Reply;
      if (reply.id !== undefined) this.#waiting.get(reply.id)?.(reply);
      else this.#events.get(reply.method!)?.(reply.params!);
    });
  }

  static async open(browser: Browser, url: string): Promise<BarePage> {
    const root = await browser.newBrowserCDPSession();
    const { targetId } = await root.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await root.send("Target.attachToTarget", { targetId, flatten: false });
    const page = new BarePage(root, sessionId, targetId);
    await page.#send("Emulation.setDeviceMetricsOverride", { width: 1280, height: 800, deviceScaleFactor: 1, mobile: false });
    await page.#send("Page.enable");
    await page.#send("Page.navigate", { url });
    await page.until("window.__lpdeform !== undefined");
    return page;
  }

  async #send(method: string, params: object = {}): Promise<Record<string, unknown>> {
    const id = ++this.#lastId;
    const reply = new Promise<Reply>((done) => this.#waiting.set(id, done));
    const { root, sessionId } = this;
    await root.send("Target.sendMessageToTarget", { sessionId, message: JSON.stringify({ id, method, params }) });
    const { error, result } = await reply;
    this.#waiting.delete(id);
    if (error) throw new Error(`${method}: ${error.message}`);
    return result ?? {};
  }

  async evaluate<Value>(expression: string): Promise<Value> {
    const asked = { expression, awaitPromise: true, returnByValue: true };
    const { result, exceptionDetails } = await this.#send("Runtime.evaluate", asked);
    if (exceptionDetails) throw new Error(`${expression}: ${JSON.stringify(exceptionDetails).slice(0, 500)}`);
    return (result as { value: Value }).value;
  }

  /** Of the page's test interface. */
  ask<Value>(what: string): Promise<Value> {
    return this.evaluate(`window.__lpdeform.${what}`);
  }

  async until(expression: string, pauseMs = 50, limitMs = 60_000): Promise<void> {
    const end = performance.now() + limitMs;
    while (!(await this.evaluate(`Boolean(${expression})`))) {
      if (performance.now() > end) throw new Error(`It is not so: ${expression}`);
      await new Promise((again) => setTimeout(again, pauseMs));
    }
  }

  async settled(pauseMs = 50): Promise<void> {
    await this.until(`window.__lpdeform.status() === "live"`, pauseMs);
    await this.until(
      `(({ isFinal, isSettling } = {}) => isFinal && !isSettling)(window.__lpdeform.frame(0))`,
      pauseMs,
      300_000,
    );
  }

  async mouse(type: "mouseMoved" | "mousePressed" | "mouseReleased", x: number, y: number, isDown = false): Promise<void> {
    const button = type === "mouseMoved" && !isDown ? "none" : "left";
    const buttons = type === "mousePressed" || isDown ? 1 : 0;
    await this.#send("Input.dispatchMouseEvent", { type, x, y, button, buttons, clickCount: type === "mouseMoved" ? 0 : 1 });
  }

  async click({ x, y }: { x: number; y: number }): Promise<void> {
    await this.mouse("mouseMoved", x, y);
    await this.mouse("mousePressed", x, y);
    await this.mouse("mouseReleased", x, y);
  }

  /** Written there first: a file that a test sends to the page keeps the page busy. */
  async openFile(path: string, content: string | Uint8Array): Promise<void> {
    writeFileSync(path, content);
    await this.#send("Page.setInterceptFileChooserDialog", { enabled: true });
    const chooser = new Promise<Record<string, unknown>>((opened) => this.#events.set("Page.fileChooserOpened", opened));
    await this.click(await this.evaluate(openButton));
    const { backendNodeId } = await chooser;
    await this.#send("DOM.setFileInputFiles", { files: [path], backendNodeId });
  }

  async close(): Promise<void> {
    await this.root.send("Target.closeTarget", { targetId: this.targetId });
    await this.root.detach();
  }
}
