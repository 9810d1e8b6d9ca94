// Live drags of the fine bar, 10,124 vertices: npm run drag, for SECONDS (default 12) each. By encoding, the C++ client at the
// server, the same through Envoy, and the page, as it measures itself. Measures, does not judge.
import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { loadavg } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import type { CDPSession } from "playwright-core";
import { afterAll, beforeAll, expect, it } from "vitest";
import { root, Service } from "../../../client/test/support/service.js";
import { type MeterFacts, User } from "../real/user.js";

const seconds = Number(process.env["SECONDS"] ?? 12);
const nativeDrag = process.env["LPDEFORM_NATIVE_DRAG"] ?? join(root, "build/release/bin/native_drag");
type Table = (readonly (string | number)[])[];
const table: Table = [["encoding", "who", "inputs", "frames/s", "p50 ms", "p99 ms", "server", "Envoy", "Chromium", "load"]];
const shares: Table = [["encoding", "page", "Envoy", "server and way", "drawing", "p99: page", "server and way", "kB/s"]];
let service: Service;

beforeAll(async () => {
  if (!existsSync(nativeDrag)) {
    throw new Error(`${nativeDrag} is missing: cmake --preset release -DLPDEFORM_BUILD_BENCH=ON, then its target native_drag`);
  }
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(async () => {
  await service.stop();
  console.log(
    [
      "From an input to its answer: the frame in the C++ client, the picture in the page. Cores that each program keeps busy.",
      ...aligned(table, 2),
      "",
      "Of the page's median, in ms: Envoy (what the C++ client takes longer through it), server and way (from sending to the frame",
      "in the page, which waits where the page draws; Envoy is part of it), drawing (the rest: the browser's share).",
      ...aligned(shares, 1),
    ].join("\n"),
  );
});

/** Lines of a table whose first columns are text. */
function aligned(rows: Table, texts: number): string[] {
  const widths = rows[0]!.map((_, column) => Math.max(...rows.map((row) => String(row[column]).length)));
  return rows.map((row) =>
    row
      .map((cell, column) => (column < texts ? String(cell).padEnd(widths[column]!) : String(cell).padStart(widths[column]!)))
      .join("  "),
  );
}

type Latency = Pick<MeterFacts, "inputs" | "framesPerSecond" | "p50" | "p99">;

/** How many cores each part keeps busy between now and the call of the result. */
async function startCores(browser?: CDPSession): Promise<() => Promise<string[]>> {
  const used = async () => [
    service.cpuSeconds("server"),
    service.cpuSeconds("envoy"),
    browser
      ? (await browser.send("SystemInfo.getProcessInfo")).processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0)
      : NaN,
  ];
  const begin = performance.now();
  const before = await used();
  return async () => {
    const passed = (performance.now() - begin) / 1000;
    return (await used()).map((after, k) => (Number.isNaN(after) ? "" : ((after - before[k]!) / passed).toFixed(2)));
  };
}

function note(encoding: string, who: string, { inputs, framesPerSecond, p50, p99 }: Latency, cores: string[]): void {
  const numbers = [inputs, framesPerSecond.toFixed(0), p50.toFixed(1), p99.toFixed(1)];
  table.push([encoding, who, ...numbers, ...cores, loadavg()[0]!.toFixed(1)]);
}

async function native(encoding: string, who: string, address: string): Promise<Latency> {
  const cores = await startCores();
  const { stdout } = await promisify(execFile)(nativeDrag, [address, encoding, String(seconds)]);
  const latency = JSON.parse(stdout) as Latency & { vertices: number };
  note(encoding, who, latency, await cores());
  return latency;
}

it.each(["float32", "quantized", "compressed"] as const)(
  "%s",
  async (encoding) => {
    const direct = await native(encoding, "C++ client, server", service.serverAddress);
    const proxied = await native(encoding, "C++ client, Envoy", new URL(service.url).host);
    const page = await inPage(encoding);
    note(encoding, "page", page, page.cores);
    const { p50, p99, service50, service99, bytesPerSecond } = page;
    const milliseconds = [p50, proxied.p50 - direct.p50, service50, p50 - service50, p99, service99];
    shares.push([encoding, ...milliseconds.map((value) => value.toFixed(1)), (bytesPerSecond / 1000).toFixed(0)]);
  },
  (10 * seconds + 120) * 1000,
);

async function inPage(encoding: string): Promise<MeterFacts & { cores: string[] }> {
  const user = await User.open(`${service.url}/?shape=bar&detail=fine&encoding=${encoding}`);
  try {
    await user.settled();
    await user.until("window.__lpdeform.frame().gap !== undefined"); // the server has nothing more to do
    expect(await user.ask("app.mesh.positions.length")).toBe(3 * 10_124);
    const vertex = await user.ask<number>("document().handles.at(-1).vertices[0]");
    const { x, y } = await user.vertexOnPage(vertex);
    const { mouse } = user.page;
    const cores = await startCores(await user.browser.newBrowserCDPSession());
    await mouse.move(x, y);
    await mouse.down();
    const begin = performance.now();
    let middle: MeterFacts | undefined;
    for (let now = 0; now < 1000 * seconds; now = performance.now() - begin) {
      await mouse.move(x + 110 * Math.sin(now / 900), y + 40 * (1 - Math.cos(now / 700)));
      await new Promise((again) => setTimeout(again, 16));
      if (!middle && now > 500 * seconds) middle = await user.ask<MeterFacts>("meter()");
    }
    const all = await user.ask<MeterFacts>("meter()");
    const used = await cores();
    await mouse.up();
    return { ...all, framesPerSecond: middle!.framesPerSecond, bytesPerSecond: middle!.bytesPerSecond, cores: used };
  } finally {
    await user.close();
  }
}
