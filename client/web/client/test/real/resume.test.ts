import { afterAll, beforeAll, expect, test } from "vitest";
import { type Frame, openSession, type Session } from "../../src/index.js";
import { resultRecreated } from "../support/recreated.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

let service: Service;
const flags = ["--heartbeat", "2"];
beforeAll(async () => {
  service = await Service.start({ serverFlags: flags });
});
afterAll(() => service.stop());

const lifted = (height: number) => ({ translation: [0, 0, height] as const });

async function held(): Promise<Session> {
  const { mesh, handles } = grid(20);
  const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
  session.setHandles(handles);
  session.move("right", lifted(5));
  return session;
}

function largestDifference(one: Frame, other: Frame): number {
  return Math.max(...one.positions.map((value, k) => Math.abs(value - other.positions[k]!)));
}

test("after kill -9 the session is recreated and shows the same surface", async () => {
  const session = await held();
  const before = await session.settle({ timeoutMs: 20_000 });
  const { name } = session;
  await service.killServer();
  await service.startServer(flags);
  const after = await resultRecreated(session, name);
  expect(after.inputSeq).toBe(before.inputSeq);
  expect(largestDifference(before, after)).toBeLessThan(1e-4 * 27);
  session.move("right", lifted(6));
  const moved = await session.settle({ timeoutMs: 20_000 });
  expect(moved.positions[3 * 19 + 2]).toBeCloseTo(6, 5);
  await session.close();
});

test("what is moved while the server is away comes when it is back", async () => {
  const session = await held();
  await session.settle({ timeoutMs: 20_000 });
  await service.stopServer();
  for (let height = 6; height <= 9; ++height) session.move("right", lifted(height));
  await service.startServer(flags);
  const frame = await session.settle({ timeoutMs: 20_000 });
  expect(frame.positions[3 * 19 + 2]).toBeCloseTo(9, 5);
  await session.close();
});

test("a solve under way begins again", async () => {
  const session = await held();
  await session.settle({ timeoutMs: 20_000 });
  // As near to the optimum as numbers go, by the slowest method: it is under way for a while.
  const solver = { method: "lineSearch", tolerance: 1e-14, initial: "rest" } as const;
  session.set({ p: 1.5, solver: { ...solver, maxIterations: 1_000_000, timeLimitSeconds: 2 } });
  const iterations: number[] = [];
  let tellThatItRuns = () => {};
  const isRunning = new Promise<void>((resolve) => (tellThatItRuns = resolve));
  const solving = session.solve({
    deadlineMs: 60_000,
    onProgress: ({ iteration }) => iterations.push(iteration) === 3 && tellThatItRuns(),
  });
  await isRunning;
  await service.killServer();
  const reached = Math.max(...iterations);
  const before = iterations.length;
  await service.startServer(flags);
  const result = await solving;
  expect(iterations[before]).toBeLessThan(reached); // another solve, from the beginning
  expect(result.iterations).toBeGreaterThan(0);
  expect(result.positions[3 * 19 + 2]).toBeCloseTo(5, 5);
  await session.close();
});

test("heartbeats keep a stream that has nothing to say", async () => {
  const session = await held();
  await session.settle({ timeoutMs: 20_000 });
  const states: string[] = [];
  session.on("connection", (state) => states.push(state));
  // A server that is held up loses connections, too. One quiet round of three is enough.
  for (let round = 0; round === 0 || (round < 3 && states.length > 0); ++round) {
    states.length = 0;
    await new Promise((resolve) => setTimeout(resolve, 9000)); // dead after 6 s without them
    session.move("right", lifted(7 + round));
    await session.settle({ timeoutMs: 20_000 });
  }
  expect(states).toEqual([]);
  await session.close();
}, 120_000);
