// The twin of `lpdeform load`, through gRPC-Web and Envoy: updates at times that nothing puts off, each measured from then on.
//   npm run load -- --url http://localhost:8080 [--sessions 10] [--vertices 1000,10000] [--rate 10] [--seconds 10] [--p 2]
//                   [--slow-readers N] [--slow-pause SECONDS] [--reconnect SECONDS] [--report FILE.json]
// Without --url it starts a server and an Envoy of its own. The report has the keys of that of `lpdeform load`.
import { writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { parseArgs } from "node:util";
import { Service } from "../test/support/service.js";
import type { Histogram } from "./histogram.js";
import { Lane, Tally } from "./lane.js";

export interface LoadOptions {
  url: string;
  sessions: number;
  vertices: number[];
  rate: number;
  seconds: number;
  p: number;
  /** So many sessions have a second reader, which takes a frame every `slowPause` seconds (0; 1). */
  slowReaders?: number;
  slowPause?: number;
  /** Each session changes its connection every so many seconds (never). */
  reconnect?: number;
}

const lastPatienceMs = 10_000;
const sleep = (ms: number) => new Promise((next) => setTimeout(next, ms));
const milliseconds = (histogram: Histogram, percent: number) => histogram.percentile(percent) / 1000;

function ofHistogram(histogram: Histogram): Record<string, number> {
  const percents = [50, 90, 95, 99, 99.9].map((percent) => [`p${percent}`, milliseconds(histogram, percent)]);
  return {
    count: histogram.count,
    mean: histogram.mean / 1000,
    ...Object.fromEntries(percents),
    max: histogram.max / 1000,
  };
}

function ofTally(tally: Tally) {
  return {
    updates: { due: tally.due, answered: tally.latency.count, unanswered: tally.unanswered },
    input_to_frame_ms: ofHistogram(tally.latency),
    setup_ms: ofHistogram(tally.setup),
    frames: { received: tally.frames, skipped_inputs: tally.skipped, stale: tally.stale },
    payload_bytes: tally.payloadBytes,
    reconnects: tally.reconnects,
    errors: Object.fromEntries([...tally.errors].sort()),
  };
}

/** Sends each lane's updates when they are due, the lanes' moments spread over a period. Returns by how much one was late. */
async function drive({ rate, seconds }: LoadOptions, lanes: Lane[]): Promise<number> {
  const all = Math.round(rate * seconds) * lanes.length;
  const step = 1000 / (rate * lanes.length);
  const begin = performance.now();
  let latest = 0;
  for (let k = 0; k < all; ++k) {
    const due = begin + k * step;
    const wait = due - performance.now();
    if (wait > 0) await sleep(wait);
    else if (k % 16 === 0) await sleep(0); // what came has to be looked at, too
    latest = Math.max(latest, performance.now() - due);
    lanes[k % lanes.length]!.move(due);
  }
  return latest;
}

/** Has each lane change its connection once in `period` seconds, one after the other, until `isOver`. */
async function reconnectInTurn(lanes: Lane[], period: number, isOver: () => boolean): Promise<void> {
  const begin = performance.now();
  for (let k = 0; ; ++k) {
    const when = begin + (1000 * period * (k + 1)) / lanes.length;
    while (!isOver() && performance.now() < when) await sleep(Math.min(50, when - performance.now()));
    if (isOver()) return;
    await lanes[k % lanes.length]!.reconnect();
  }
}

export async function runLoad(options: LoadOptions) {
  const lanes: Lane[] = [];
  for (let k = 0; k < options.sessions; ++k) {
    lanes.push(await Lane.open(options.url, options.vertices[k % options.vertices.length]!, options.p));
  }
  const { slowReaders = 0, slowPause = 1, reconnect } = options;
  for (const lane of lanes.slice(0, slowReaders)) await lane.addSlowReader(1000 * slowPause);
  for (const lane of lanes) lane.start();
  const begin = performance.now();
  let isDriven = false;
  const reconnecting = reconnect === undefined ? undefined : reconnectInTurn(lanes, reconnect, () => isDriven);
  const behind = await drive(options, lanes);
  isDriven = true;
  await reconnecting;
  const seconds = (performance.now() - begin) / 1000;
  const end = performance.now() + lastPatienceMs;
  while (!lanes.every((lane) => lane.isAnswered) && performance.now() < end) await sleep(20);
  const every = new Tally();
  const byVertices = new Map<number, Tally>();
  const frames: number[] = [];
  for (const lane of lanes) {
    const tally = await lane.finish();
    every.add(tally);
    frames.push(tally.frames);
    if (!byVertices.has(lane.vertices)) byVertices.set(lane.vertices, new Tally());
    byVertices.get(lane.vertices)!.add(tally);
  }
  return {
    sessions: options.sessions,
    rate: options.rate,
    seconds,
    slow_readers: Math.min(slowReaders, lanes.length),
    generator_behind_ms: behind,
    frames_per_session: { least: Math.min(...frames), mean: every.frames / frames.length, most: Math.max(...frames) },
    all: { ...ofTally(every), input_to_frame_histogram_us: every.latency.buckets() },
    by_vertices: Object.fromEntries([...byVertices].map(([vertices, tally]) => [String(vertices), ofTally(tally)])),
  };
}

function numberOf(name: string, text: string): number {
  const value = Number(text);
  if (text.trim() !== "" && value > 0 && Number.isFinite(value)) return value;
  console.error(`load: --${name} takes numbers above 0, not "${text}"`);
  process.exit(2);
}

async function main(): Promise<void> {
  const one = { type: "string" } as const;
  const { values } = parseArgs({
    options: {
      ...{ url: one, sessions: one, vertices: one, rate: one, seconds: one, p: one, report: one },
      ...{ "slow-readers": one, "slow-pause": one, reconnect: one },
    },
  });
  const given = (name: Exclude<keyof typeof values, "url" | "vertices" | "report">, otherwise: number) =>
    values[name] === undefined ? otherwise : numberOf(name, values[name]);
  const service = values.url === undefined ? await Service.start() : undefined;
  try {
    const report = await runLoad({
      url: values.url ?? service!.url,
      sessions: given("sessions", 10),
      vertices: (values.vertices ?? "1000").split(",").map((text) => numberOf("vertices", text)),
      rate: given("rate", 10),
      seconds: given("seconds", 10),
      p: given("p", 2),
      slowReaders: given("slow-readers", 0),
      slowPause: given("slow-pause", 1),
      ...(values.reconnect === undefined ? {} : { reconnect: given("reconnect", 0) }),
    });
    const { updates, input_to_frame_ms: latency, frames } = report.all;
    console.log(
      `${updates.due} updates, ${updates.unanswered} unanswered; input to frame p50 ${latency["p50"]}, p95 ${latency["p95"]}, ` +
        `p99 ${latency["p99"]}, max ${latency["max"]} ms; ${(frames.received / report.seconds).toFixed(1)} frames/s, ` +
        `${frames.skipped_inputs} inputs skipped; sent at most ${report.generator_behind_ms.toFixed(1)} ms late`,
    );
    if (values.report !== undefined) writeFileSync(values.report, JSON.stringify(report, null, 1) + "\n");
    process.exitCode = updates.unanswered === 0 && Object.keys(report.all.errors).length === 0 ? 0 : 1;
  } finally {
    await service?.stop();
  }
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? "").href) await main();
