import { type ChildProcess, spawn } from "node:child_process";
import { once } from "node:events";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { CDPSession } from "playwright-core";
import { cpuSecondsOf, root } from "../../../client/test/support/service.js";

const parts = { server: "lpdeform-server", envoy: "envoy" };

/** A running deploy/up, as a person starts it. */
export class Up {
  #process!: ChildProcess;
  #output = "";
  #ports = ["--port", "0", "--web-port", "0"];
  /** What it tells to open. */
  url = "";

  static async start(): Promise<Up> {
    const up = new Up();
    await up.startServer();
    return up;
  }

  /** Of all of it; the ports are those that it had before, if it had any. */
  async startServer(): Promise<void> {
    this.#output = "";
    const child = spawn(join(root, "deploy/up"), this.#ports, { stdio: ["ignore", "pipe", "pipe"] });
    this.#process = child;
    await new Promise<void>((resolve, reject) => {
      const read = (text: Buffer) => {
        this.#output += text;
        if (/^Ctrl-C stops/m.test(this.#output)) resolve();
      };
      child.stdout.on("data", read);
      child.stderr.on("data", read);
      child.once("exit", (status) => reject(new Error(`deploy/up ended with ${status}:\n${this.#output}`)));
    });
    this.url = /^Open in a browser: +(\S+)/m.exec(this.#output)![1]!;
    const port = /serves on 127\.0\.0\.1:(\d+)/.exec(this.#output)![1]!;
    this.#ports = ["--port", port, "--web-port", new URL(this.url).port];
  }

  /** Kills the server without a word to anybody. deploy/up names it, stops the rest and ends. */
  async killServer(): Promise<void> {
    const ended = once(this.#process, "exit");
    process.kill(this.#pidOf("server"), "SIGKILL");
    const [status] = await ended;
    const isNamed = /^deploy\/up: the server, whose log is .* has ended by itself with status 137/m.test(this.#output);
    if (status !== 1 || !isNamed) throw new Error(`deploy/up ended with ${status}:\n${this.#output}`);
  }

  /** What it has computed so far, on all cores together. */
  cpuSeconds(part: keyof typeof parts): number {
    return cpuSecondsOf(this.#pidOf(part));
  }

  /** The same of server, Envoy and this browser, in seconds of one core: what else runs here hardly counts. */
  async computedWith(browser: CDPSession): Promise<number> {
    const { processInfo } = await browser.send("SystemInfo.getProcessInfo");
    return processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, this.cpuSeconds("server") + this.cpuSeconds("envoy"));
  }

  /** As Ctrl-C does. */
  async stop(): Promise<void> {
    if (this.#process.exitCode !== null) return;
    const ended = once(this.#process, "exit");
    this.#process.kill("SIGTERM");
    await ended;
  }

  #pidOf(part: keyof typeof parts): number {
    const { pid } = this.#process;
    const children = readFileSync(`/proc/${pid}/task/${pid}/children`, "utf8").trim().split(" ").map(Number);
    return children.find((one) => readFileSync(`/proc/${one}/comm`, "utf8").trim() === parts[part])!;
  }
}
