import { type ChildProcess, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

const chromium = process.env["CHROMIUM"] ?? "/usr/bin/chromium";

/** What DevTools speak, over one socket. */
class Tools {
  readonly #answers = new Map<number, { done(result: unknown): void; failed(error: Error): void }>();
  #last = 0;

  private constructor(
    readonly socket: WebSocket,
    onEvent: (method: string, params: unknown) => void,
  ) {
    socket.addEventListener("message", ({ data }) => {
      const { id, method, params, result, error } = JSON.parse(data as string);
      if (id === undefined) return onEvent(method, params);
      const answer = this.#answers.get(id)!;
      this.#answers.delete(id);
      if (error) answer.failed(new Error(error.message));
      else answer.done(result);
    });
    socket.addEventListener("close", () => {
      for (const { failed } of this.#answers.values()) failed(new Error("the browser has gone"));
    });
  }

  static async connect(url: string, onEvent: (method: string, params: unknown) => void = () => {}): Promise<Tools> {
    const socket = new WebSocket(url);
    await new Promise((opened, failed) => {
      socket.addEventListener("open", opened, { once: true });
      socket.addEventListener("error", () => failed(new Error(`nothing answers at ${url}`)), { once: true });
    });
    return new Tools(socket, onEvent);
  }

  send<Result = unknown>(method: string, params: object = {}): Promise<Result> {
    const id = ++this.#last;
    this.socket.send(JSON.stringify({ id, method, params }));
    return new Promise((done, failed) => this.#answers.set(id, { done: done as (result: unknown) => void, failed }));
  }
}

/**
 * A page that no library drives. Playwright has the renderer keep the last 100 MB of what comes over the network, and each of its
 * connections leaves a world of scripts in the page: not for somebody who counts memory.
 */
export class BarePage {
  readonly errors: string[] = [];
  #page!: Tools;
  #browser!: Tools;

  private constructor(
    readonly process: ChildProcess,
    readonly folder: string,
  ) {}

  /** `browserFlags`: of Chromium, beside what a page needs that nobody sees. */
  static async open(url: string, browserFlags: readonly string[] = ["--no-sandbox"]): Promise<BarePage> {
    const folder = mkdtempSync(join(tmpdir(), "lpdeform-browser-"));
    const flags = [
      "--headless=new",
      "--remote-debugging-port=0",
      `--user-data-dir=${folder}`,
      "--window-size=1280,800",
    ];
    const child = spawn(chromium, [...browserFlags, ...flags, "--no-first-run", "about:blank"], {
      stdio: ["ignore", "ignore", "pipe"],
    });
    const page = new BarePage(child, folder);
    await page.#connect(await endpoint(child));
    await page.#page.send("Runtime.enable");
    await page.#page.send("Page.setBypassCSP", { enabled: true }); // what is asked is evaluated
    await page.#page.send("Page.navigate", { url });
    return page;
  }

  async #connect(browser: string): Promise<void> {
    const targets = (await (await fetch(`http://${new URL(browser).host}/json/list`)).json()) as Record<
      string,
      string
    >[];
    const { webSocketDebuggerUrl } = targets.find(({ type }) => type === "page")!;
    this.#browser = await Tools.connect(browser);
    this.#page = await Tools.connect(webSocketDebuggerUrl!, (method, params) => {
      const { exceptionDetails: details } = params as {
        exceptionDetails?: { text: string; exception?: { description?: string } };
      };
      if (method === "Runtime.exceptionThrown") this.errors.push(details!.exception?.description ?? details!.text);
    });
  }

  /** Of the viewer's test interface. */
  async ask<Value>(what: string): Promise<Value> {
    return this.evaluate(`window.__lpdeform.${what}`);
  }

  /** Where it is a promise: what that gives. */
  async evaluate<Value>(expression: string): Promise<Value> {
    const { result, exceptionDetails } = await this.#page.send<{
      result: { value: Value };
      exceptionDetails?: { text: string };
    }>("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.text}`);
    return result.value;
  }

  async until(condition: string, timeout = 60_000): Promise<void> {
    const end = performance.now() + timeout;
    while (!(await this.evaluate(`Boolean(${condition})`))) {
      if (performance.now() > end) throw new Error(`not within ${timeout} ms: ${condition}`);
      await new Promise((again) => setTimeout(again, 50));
    }
  }

  settled(): Promise<void> {
    return this.until(`(() => {
      const facts = window.__lpdeform?.frame(0);
      return facts && facts.isFinal && !facts.isSettling && window.__lpdeform.status() === "live";
    })()`);
  }

  async mouse(
    type: "mouseMoved" | "mousePressed" | "mouseReleased",
    x: number,
    y: number,
    isDown: boolean,
  ): Promise<void> {
    await this.#page.send("Input.dispatchMouseEvent", {
      type,
      x,
      y,
      button: isDown ? "left" : "none",
      buttons: +isDown,
      clickCount: 1,
    });
  }

  /** A character, with the control key where it is so. */
  async press(key: string, isControl = false): Promise<void> {
    const event = { key, modifiers: isControl ? 2 : 0 };
    await this.#page.send("Input.dispatchKeyEvent", { type: "keyDown", ...event, ...(!isControl && { text: key }) });
    await this.#page.send("Input.dispatchKeyEvent", { type: "keyUp", ...event });
  }

  /** Bytes that the page's scripts hold, after what they no longer use has been collected, and the browser's processes. */
  async held(): Promise<{ scripts: number; processes: number[] }> {
    await this.#page.send("HeapProfiler.collectGarbage");
    const heap = await this.#page.send<{ usedSize: number; backingStorageSize?: number }>("Runtime.getHeapUsage");
    const { processInfo } = await this.#browser.send<{ processInfo: { id: number }[] }>("SystemInfo.getProcessInfo");
    return { scripts: heap.usedSize + (heap.backingStorageSize ?? 0), processes: processInfo.map(({ id }) => id) };
  }

  async close(): Promise<void> {
    const ended = new Promise((end) => this.process.once("exit", end));
    this.process.kill();
    await ended;
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 });
  }
}

async function endpoint(child: ChildProcess): Promise<string> {
  for await (const line of createInterface({ input: child.stderr! })) {
    const found = /DevTools listening on (ws:\S+)/.exec(line);
    if (!found) continue;
    child.stderr!.resume();
    return found[1]!;
  }
  throw new Error(`${chromium} ended before it said where to reach it`);
}
