// Latency by size: the C++ client at the server, the same through Envoy, and the callback of a page in Chromium through Envoy, in
// turns. tests/bench/latency/web builds what it needs and says what its options are.
import { execFile } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { parseArgs, promisify } from "node:util";
import { build } from "vite";
import { BarePage } from "../test/support/bare_page.js";
import { root, Service } from "../test/support/service.js";
import type { Encoding } from "../src/index.js";
import { type Drag, drag, type DragFacts } from "./latency/drag.js";
import type {} from "./latency/page.js";

const nativeDrag = process.env["LPDEFORM_NATIVE_DRAG"] ?? join(root, "build/release/bin/native_drag");
const movesPerSecond = 30;
const spans = {
  taken: "lpdeform_input_to_solve_seconds",
  shown: "lpdeform_input_to_frame_seconds",
} as const;

type Row = Pick<DragFacts, "vertices" | "inputs" | "p50" | "p99" | "mean"> & Partial<DragFacts>;
type Spans = Record<keyof typeof spans, number>;
type Measured = Row & Spans;

async function freePort(): Promise<number> {
  const server = createServer();
  await new Promise<void>((open) => server.listen(0, "127.0.0.1", open));
  const { port } = server.address() as { port: number };
  await new Promise((closed) => server.close(closed));
  return port;
}

/** The sum and count of each span of the server. */
async function counted(admin: number): Promise<Record<keyof typeof spans, [number, number]>> {
  const text = await (await fetch(`http://127.0.0.1:${admin}/metrics`)).text();
  const value = (name: string) => Number(new RegExp(`^${name} (\\S+)$`, "m").exec(text)?.[1] ?? 0);
  const of = (name: string): [number, number] => [value(`${name}_sum`), value(`${name}_count`)];
  return { taken: of(spans.taken), shown: of(spans.shown) };
}

const median = (values: number[]) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)] ?? NaN;

function medians(rows: Measured[]): Measured {
  const keys = Object.keys(rows[0]!) as (keyof Measured)[];
  return Object.fromEntries(
    keys.map((key) => [key, median(rows.map((row) => row[key] ?? NaN))]),
  ) as unknown as Measured;
}

async function native(address: string, options: Drag): Promise<Row> {
  const { encoding, seconds, vertices, p, framesPerSecond } = options;
  const words = [address, encoding, seconds, vertices, p, movesPerSecond, framesPerSecond].map(String);
  return JSON.parse((await promisify(execFile)(nativeDrag, words)).stdout) as Row;
}

const one = { type: "string" } as const;
const { values } = parseArgs({
  options: { sizes: one, seconds: one, p: one, frames: one, rounds: one, encoding: one },
});
const base: Omit<Drag, "vertices"> = {
  p: Number(values.p ?? 2),
  movesPerSecond,
  framesPerSecond: Number(values.frames ?? 60),
  seconds: Number(values.seconds ?? 10),
  encoding: (values.encoding ?? "float32") as Encoding,
};
const files = mkdtempSync(join(tmpdir(), "lpdeform-latency-"));
await build({
  root: join(root, "client/web/client/bench/latency"),
  base: "./",
  logLevel: "error",
  configFile: false,
  build: { outDir: files, target: "es2022" },
});
const admin = await freePort();
const service = await Service.start({ files, serverFlags: ["--admin-address", `127.0.0.1:${admin}`] });
const page = await BarePage.open(service.url);
await page.until("window.drag");
const who: Record<string, (options: Drag) => Promise<Row>> = {
  "C++, at the server": (options) => native(service.serverAddress, options),
  "C++, through Envoy": (options) => native(new URL(service.url).host, options),
  "Node, through Envoy": (options) => drag({ ...options, url: service.url }),
  "page, through Envoy": (options) => page.evaluate<Row>(`window.drag(${JSON.stringify(options)})`),
};

async function measured(name: string, options: Drag): Promise<Measured> {
  const before = await counted(admin);
  const row = await who[name]!(options);
  const after = await counted(admin);
  const mean = (key: keyof typeof spans) =>
    (1000 * (after[key][0] - before[key][0])) / (after[key][1] - before[key][1]);
  return { ...row, taken: mean("taken"), shown: mean("shown") };
}

const columns = ["vertices", "client", "median", "p99", "more than C++ at the server: median", "p99"];
const parts = ["until the solver has it", "from there until a frame is there", "the rest"];
const inPage = [
  "of the page: until the request is out",
  "until the first bytes",
  "until the last bytes",
  "until the callback",
];
const all = [...columns, ...parts, ...inPage];
console.log(`| ${all.join(" | ")} |\n|--:|:--|${"--:|".repeat(all.length - 2)}`);
for (const vertices of (values.sizes ?? "1000,10000,40000,100000").split(",").map(Number)) {
  const rows = new Map<string, Measured[]>(Object.keys(who).map((name) => [name, []]));
  for (let round = 0; round < Number(values.rounds ?? 3); ++round) {
    for (const [name, of] of rows) of.push(await measured(name, { ...base, vertices }));
  }
  let direct: Measured | undefined;
  for (const [name, of] of rows) {
    const row = medians(of);
    direct ??= row;
    const ms = (value: number | undefined) =>
      value === undefined || Number.isNaN(value) ? "" : `${value.toFixed(1)} ms`;
    const cells = [row.vertices, name, ms(row.p50), ms(row.p99), ms(row.p50 - direct.p50), ms(row.p99 - direct.p99)];
    cells.push(ms(row.taken), ms(row.shown - row.taken), ms(row.mean - row.shown));
    console.log(`| ${[...cells, ...[row.request, row.away, row.arriving, row.decoding].map(ms)].join(" | ")} |`);
  }
}
console.log("\nFrom a move to the frame that answers it: the median of the rounds. The parts are means.");
if (page.errors.length > 0) console.error(page.errors.join("\n"));
await page.close();
await service.stop();
rmSync(files, { recursive: true, force: true });
process.exit(page.errors.length > 0 ? 1 : 0);
