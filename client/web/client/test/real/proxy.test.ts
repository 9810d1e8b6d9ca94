import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { afterAll, beforeAll, describe, expect, test, vi } from "vitest";
import { openSession, type Session } from "../../src/index.js";
import { envoyProgram, root, Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

const configure = (...flags: string[]) =>
  execFileSync(join(root, "deploy/envoy-config"), flags, { encoding: "utf8", stdio: "pipe" });

async function waitFor(isSo: () => Promise<boolean> | boolean): Promise<void> {
  while (!(await isSo())) await new Promise((again) => setTimeout(again, 50));
}

describe("the configuration", () => {
  const work = mkdtempSync(join(tmpdir(), "lpdeform-config-"));
  afterAll(() => rmSync(work, { recursive: true }));

  test.each([
    ["as it is", []],
    [
      "with everything said",
      [
        "--web",
        "0.0.0.0:0",
        "--server",
        "server.example:1",
        "--files",
        "none",
        "--admin-port",
        "9901",
        "--access-log",
        "/dev/null",
        "--max-requests",
        "7",
        "--max-heap",
        "100",
        "--idle",
        "5",
        "--origin",
        "https://a.example",
        "--origin",
        "http://localhost:*",
      ],
    ],
  ])("%s is valid", (_, flags) => {
    const file = join(work, "envoy.yaml");
    writeFileSync(file, configure(...flags));
    const said = execFileSync(envoyProgram, ["--mode", "validate", "-c", file, "--log-level", "error"], {
      encoding: "utf8",
      stdio: "pipe",
    });
    expect(said).toContain("OK");
  });

  test("reads the viewer's files, and refuses what is none by name", () => {
    const files = mkdtempSync(join(work, "files-"));
    expect(() => configure("--files", files)).toThrow(
      expect.objectContaining({ status: 2, stderr: expect.stringContaining(`${files} has no index.html`) }),
    );
    writeFileSync(join(files, "index.html"), "<p>");
    expect(configure("--files", files)).toContain(`filename: "${files}/index.html"`);
    for (const name of ["notes.doc", "a b.js"]) {
      writeFileSync(join(files, name), "");
      expect(() => configure("--files", files)).toThrow(
        expect.objectContaining({ status: 2, stderr: expect.stringContaining(name) }),
      );
      rmSync(join(files, name));
    }
  });

  test.each([
    ["--web", "8080"],
    ["--server", "localhost:70000"],
    ["--admin-port", "x"],
    ["--idle", "0"],
    ["--max-requests", "0"],
    ["--max-heap", "9"],
    ["--origin", 'http://a"b'],
    ["--nothing", "1"],
  ])("%s '%s' is refused by name", (option, value) => {
    expect(() => configure(option, value)).toThrow(
      expect.objectContaining({ status: 2, stderr: expect.stringContaining(option) }),
    );
  });

  test("retries nothing on streams and never gives them a deadline", () => {
    const routes = configure("--files", "none").split("- match: ");
    const streams = routes.filter((route) => /route: (&|\*)streams/.test(route));
    const names = streams.map((route) => /path: \/lpdeform.v1.DeformService\/(\w+)}/.exec(route)![1]);
    expect(names).toEqual(["StreamSessions", "StreamFrames", "Deform", "Solve", "SnapshotSession"]);
    expect(streams[0]).toMatch(/route: &streams\n\s+cluster: lpdeform\n\s+timeout: 0s/);
    for (const stream of streams) expect(stream).not.toMatch(/retry/);
  });

  test("tries other calls again only where no server has seen them", () => {
    expect(configure().match(/retry_on: .*/g)).toEqual(["retry_on: connect-failure,refused-stream"]);
  });
});

describe("the proxy", () => {
  let service: Service;
  const files = mkdtempSync(join(tmpdir(), "lpdeform-files-"));
  const script = `export const numbers = [${Array.from({ length: 60_000 }, (_, k) => k).join()}];`;
  beforeAll(async () => {
    mkdirSync(join(files, "assets"));
    writeFileSync(join(files, "index.html"), "<!doctype html>");
    writeFileSync(join(files, "assets/numbers-1a2b.js"), script);
    service = await Service.start({
      files,
      serverFlags: ["--heartbeat", "0.3"],
      origins: ["https://friend.example"],
      idleSeconds: 1,
    });
  });
  afterAll(async () => {
    await service.stop();
    rmSync(files, { recursive: true });
  });

  const call = (origin?: string, init: RequestInit = {}) =>
    fetch(`${service.url}/lpdeform.v1.DeformService/GetSession`, {
      method: "POST",
      body: new Uint8Array(5),
      ...init,
      headers: {
        "content-type": "application/grpc-web+proto",
        "x-grpc-web": "1",
        ...(origin && { origin }),
        ...init.headers,
      },
    });

  test("leaves a solve to which nobody listens for longer than a silent stream may be", async () => {
    const { mesh, handles } = grid(80);
    const solver = { method: "lineSearch", tolerance: 1e-14, maxIterations: 1_000_000, timeLimitSeconds: 3 } as const;
    const session = await openSession(mesh, { url: service.url, settings: { p: 1.5, solver } });
    session.setHandles(handles);
    session.move("right", { axis: [0, 1, 0], angle: -2, center: [40, 0, 0], translation: [0, 10, 30] });
    const start = performance.now();
    await session.solve({ deadlineMs: 20_000 });
    expect(performance.now() - start).toBeGreaterThan(2000); // the server's own reckoning of time leaves out what it waits
    await session.close();
  });

  test("lets pages of known origins call and read how calls end", async () => {
    const preflight = await call("https://friend.example", {
      method: "OPTIONS",
      body: null,
      headers: {
        "access-control-request-method": "POST",
        "access-control-request-headers": "x-grpc-web,lpdeform-session,authorization,traceparent",
      },
    });
    expect(preflight.status).toBe(200);
    expect(preflight.headers.get("access-control-allow-origin")).toBe("https://friend.example");
    const allowed = preflight.headers.get("access-control-allow-headers")!.split(", ");
    expect(allowed).toEqual(expect.arrayContaining(["lpdeform-session", "authorization", "traceparent"]));
    const answer = await call("https://friend.example");
    expect(answer.headers.get("access-control-expose-headers")).toBe(
      "grpc-status, grpc-message, grpc-status-details-bin",
    );
    expect((await call("https://stranger.example")).headers.get("access-control-allow-origin")).toBeNull();
  });

  test("says at once that the server is away", async () => {
    await service.killServer();
    await waitFor(async () => (await call()).headers.get("grpc-status") === "14");
    const start = performance.now();
    await call();
    expect(performance.now() - start).toBeLessThan(10_000); // Envoy gives calls 60 s
    await service.startServer(["--heartbeat", "0.3"]);
    await waitFor(async () => (await call()).headers.get("grpc-status") === "5");
  });

  test("serves the viewer's files whole, compressed, and kept where their names change with them", async () => {
    const page = await fetch(service.url);
    expect([page.status, page.headers.get("content-type"), page.headers.get("cache-control")]).toEqual([
      200,
      "text/html",
      "no-cache",
    ]);
    expect(await page.text()).toBe("<!doctype html>");
    const asset = await fetch(`${service.url}/assets/numbers-1a2b.js?again`);
    expect(asset.headers.get("content-type")).toBe("text/javascript");
    expect(asset.headers.get("content-encoding")).toBe("gzip");
    expect(asset.headers.get("cache-control")).toContain("immutable");
    expect(await asset.text()).toBe(script);
    const plain = await fetch(`${service.url}/assets/numbers-1a2b.js`, { headers: { "accept-encoding": "identity" } });
    expect(plain.headers.get("content-encoding")).toBeNull();
    expect(await plain.text()).toBe(script);
  });

  test("serves nothing else", async () => {
    expect((await fetch(`${service.url}/healthz`)).status).toBe(200);
    expect((await fetch(`${service.url}/assets/`)).status).toBe(404);
    expect((await fetch(`${service.url}/nothing.js`)).status).toBe(404);
    expect((await fetch(`${service.url}/..%2f..%2fetc/passwd`)).status).toBe(400);
  });

  test("logs each call with how it ended", async () => {
    await call();
    const ended = { method: "POST", status: 200, grpc_status: "NotFound" };
    await vi.waitFor(() => {
      const lines = readFileSync(service.accessLog, "utf8").split("\n").filter(Boolean);
      const calls = lines.map((line) => JSON.parse(line)).filter(({ path }) => path.endsWith("/GetSession"));
      expect(calls.at(-1)).toMatchObject(ended); // Envoy writes a little later
    }, 30_000);
  }, 60_000);
});

test("a stream that has nothing to say but heartbeats is left alone", async () => {
  const service = await Service.start({ serverFlags: ["--heartbeat", "4"], idleSeconds: 10 });
  const { mesh, handles } = grid(4);
  const session = await openSession(mesh, { url: service.url });
  session.setHandles(handles);
  await session.settle();
  const states: string[] = [];
  session.on("connection", (state) => states.push(state));
  // A server that is held up loses connections, too. One quiet round of three is enough.
  for (let round = 0; round === 0 || (round < 3 && states.length > 0); ++round) {
    states.length = 0;
    await new Promise((resolve) => setTimeout(resolve, 17_000)); // Envoy's own default cuts at 15 s
    session.move("right", { translation: [0, 0, 1 + round] });
    await session.settle({ timeoutMs: 20_000 });
  }
  expect(states).toEqual([]);
  await session.close();
  await service.stop();
}, 180_000);

test("calls beyond what Envoy lets through are refused by name, and go well when there is room", async () => {
  const service = await Service.start({ maxRequests: 2 });
  // Streams of their own, since they are asked for in other ways.
  const open = (callTimeoutMs: number) => openSession(grid(4).mesh, { url: service.url, callTimeoutMs });
  // The acknowledgements of one may take the place that the other needs.
  const openInTime = (callTimeoutMs: number) => vi.waitFor(() => open(callTimeoutMs), 20_000);
  const isConnected = (session: Session) => waitFor(() => session.connection === "connected");
  const first = await open(30_001);
  first.poll();
  await isConnected(first);
  const second = await openInTime(30_002);
  second.poll();
  await isConnected(second);
  await expect(open(30_003)).rejects.toMatchObject({
    code: "unavailable",
    message: expect.stringContaining("overflow"),
  });
  // An update waits until there is room, and is not lost.
  first.setHandle("corner", { vertices: [0] });
  await second.close().catch(() => undefined); // ends its stream, though its last call may be refused
  expect((await first.settle({ timeoutMs: 20_000 })).inputSeq).toBe(1);
  const third = await openInTime(30_003);
  for (const session of [third, first]) await session.close().catch(() => undefined); // each may meet the other's last call
  await service.stop();
}, 120_000);

test("the access log is set aside when it has grown, and goes on", async () => {
  const service = await Service.start({ accessLogBytes: 1 });
  const call = () => fetch(`${service.url}/healthz`);
  const old = `${service.accessLog}.1`;
  const isLogged = (file: string) => existsSync(file) && readFileSync(file, "utf8").includes("/healthz");
  await call();
  await waitFor(() => isLogged(old));
  rmSync(old);
  await call();
  await waitFor(() => isLogged(old)); // what was written since went through a log of its own
  expect(readdirSync(dirname(old)).filter((name) => name.startsWith("access.log")).length).toBeLessThanOrEqual(2);
  await service.stop();
}, 120_000);

test("an access log that is full already is set aside before Envoy starts, and a smaller one goes on", async () => {
  const [full, small] = ["of yesterday\n".repeat(1000), "of today\n"];
  for (const [loggedBefore, isAside] of [
    [full, true],
    [small, false],
  ] as const) {
    const service = await Service.start({ accessLogBytes: 10_000, loggedBefore });
    const read = (file: string) => (existsSync(file) ? readFileSync(file, "utf8") : undefined);
    await fetch(`${service.url}/healthz`);
    await waitFor(() => read(service.accessLog)?.includes("/healthz") ?? false);
    expect(read(`${service.accessLog}.1`)).toBe(isAside ? full : undefined);
    expect(read(service.accessLog)!.startsWith(small)).toBe(!isAside);
    await service.stop();
  }
}, 120_000);

test("a stream that says nothing at all is cut and taken up again", async () => {
  const service = await Service.start({ serverFlags: ["--heartbeat", "3600"], idleSeconds: 1 });
  const session = await openSession(grid(4).mesh, { url: service.url });
  const states: string[] = [];
  session.on("connection", (state) => states.push(state));
  session.poll();
  await waitFor(() => states.length >= 3);
  expect(states.slice(0, 3)).toEqual(["connected", "reconnecting", "connected"]);
  await session.close();
  await service.stop();
});
