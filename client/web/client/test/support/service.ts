import { type ChildProcess, execFileSync, spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";

/** Of the project; compiled files lie deeper than their sources. */
export const root = (function above(folder: string): string {
  return existsSync(join(folder, "CMakePresets.json")) ? folder : above(resolve(folder, ".."));
})(import.meta.dirname);
const serverProgram = process.env["LPDEFORM_SERVER"] ?? join(root, "build/release/bin/lpdeform-server");
export const envoyProgram = join(root, "build/web-tools/bin/envoy");

/** What a process has computed so far, on all cores together. */
export function cpuSecondsOf(pid: number): number {
  const fields = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1]!.split(" ");
  return (Number(fields[11]) + Number(fields[12])) / 100; // user and system, in the kernel's hundredths of a second
}

/** A server and an Envoy before it, as deploy/up runs them, on free ports. */
export class Service {
  readonly #work = mkdtempSync(join(tmpdir(), "lpdeform-"));
  #server: ChildProcess | undefined;
  #envoy: ChildProcess | undefined;
  #address = "127.0.0.1:0";
  #envoyFlags: string[] = [];
  #envoyEnvironment: Record<string, string> = {};
  readonly accessLog = join(this.#work, "access.log");
  /** Where browsers connect. */
  url = "";
  /** Envoy's own page. */
  admin = "";

  /**
   * `files`: what Envoy serves beside; `serverFlags`: of lpdeform-server; `loggedBefore`: what the access log begins with; `isLow`: the
   * server computes only when no other process wants to.
   */
  static async start({
    files = "",
    serverFlags = [] as string[],
    origins = [] as string[],
    idleSeconds = 60,
    maxRequests = 4096,
    accessLogBytes = 1 << 26,
    loggedBefore = "",
    isLow = false,
  } = {}): Promise<Service> {
    const service = new Service();
    if (loggedBefore) writeFileSync(service.accessLog, loggedBefore);
    await service.startServer(serverFlags, isLow);
    service.#envoyFlags = [
      "--web",
      "127.0.0.1:0",
      "--server",
      service.#address,
      "--files",
      files || "none",
      "--access-log",
      service.accessLog,
      "--idle",
      String(idleSeconds),
      "--max-requests",
      String(maxRequests),
      ...origins.flatMap((origin) => ["--origin", origin]),
    ];
    service.#envoyEnvironment = { LPDEFORM_ACCESS_LOG_BYTES: String(accessLogBytes) };
    await service.#startEnvoy();
    return service;
  }

  /** On the port that it had before, if it had one. */
  async startServer(flags: string[] = [], isLow = false): Promise<void> {
    const program = ["-n", isLow ? "19" : "0", serverProgram];
    const child = spawn("nice", [...program, "--address", this.#address, ...flags], {
      stdio: ["ignore", "pipe", "ignore"],
    });
    this.#server = child;
    for await (const line of createInterface({ input: child.stdout! })) {
      this.#address = line.split(" ").at(-1)!;
      return;
    }
    throw new Error(`${serverProgram} did not start`);
  }

  /** Without a word to anybody. */
  async killServer(): Promise<void> {
    await end(this.#server, "SIGKILL");
  }

  /** Stops it until resume() is called; its connections stand. */
  pause(part: "server" | "envoy"): void {
    process.kill(this.#pidOf(part), "SIGSTOP");
  }

  resume(part: "server" | "envoy"): void {
    process.kill(this.#pidOf(part), "SIGCONT");
  }

  /** Drains it. */
  async stopServer(): Promise<void> {
    await end(this.#server, "SIGTERM");
  }

  async killEnvoy(): Promise<void> {
    await end(this.#envoy, "SIGKILL");
  }

  /** Where the server is reached without Envoy. */
  get serverAddress(): string {
    return this.#address;
  }

  /** What the kernel holds in memory for it. */
  residentBytes(part: "server" | "envoy"): number {
    const status = readFileSync(`/proc/${this.#pidOf(part)}/status`, "utf8");
    return 1024 * Number(/VmRSS:\s+(\d+)/.exec(status)![1]);
  }

  /** What it has computed so far, on all cores together. */
  cpuSeconds(part: "server" | "envoy"): number {
    return cpuSecondsOf(this.#pidOf(part));
  }

  #pidOf(part: "server" | "envoy"): number {
    return (part === "server" ? this.#server : this.#envoy)!.pid!;
  }

  /** A number of Envoy's statistics. */
  async stat(name: string): Promise<number> {
    const text = await (await fetch(`${this.admin}/stats?filter=^${name}$`)).text();
    return Number(text.split(": ")[1]);
  }

  async stop(): Promise<void> {
    await Promise.all([end(this.#envoy, "SIGTERM"), end(this.#server, "SIGTERM")]);
    rmSync(this.#work, { recursive: true, force: true });
  }

  async #startEnvoy(): Promise<void> {
    const adminFile = join(this.#work, "admin");
    const program = join(root, "deploy/web");
    this.#envoy = spawn(program, ["--admin-file", adminFile, ...this.#envoyFlags], {
      stdio: "ignore",
      env: { ...process.env, ...this.#envoyEnvironment },
    });
    for (const end = performance.now() + 60_000; performance.now() < end;) {
      try {
        const admin = readFileSync(adminFile, "utf8");
        const web = execFileSync(process.execPath, [join(root, "deploy/envoy-ready.mjs"), admin], {
          encoding: "utf8",
          stdio: "pipe",
        });
        this.admin = `http://${admin}`;
        this.url = `http://${web.trim()}`;
        return;
      } catch {
        await new Promise((again) => setTimeout(again, 50));
      }
    }
    throw new Error("deploy/web did not start");
  }
}

async function end(child: ChildProcess | undefined, signal: NodeJS.Signals): Promise<void> {
  if (!child || child.exitCode !== null || child.signalCode !== null) return;
  const ended = new Promise((resolve) => child.once("exit", resolve));
  child.kill(signal);
  child.kill("SIGCONT"); // one that was paused ends only then
  await ended;
}
