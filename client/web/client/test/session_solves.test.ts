import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test, vi } from "vitest";
import { Encoding } from "../src/gen/lpdeform/v1/frame_pb.js";
import { openWith } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";
import { at, begin, opened, refusal } from "./harness.js";

const summary = {
  case: "summary",
  value: {
    energy: 3,
    iterations: 5,
    inputSeq: 2n,
    certificate: { relativeGap: 0.5 },
    minima: [4, 3] as number[],
    furtherStarts: 8,
    searchIterations: 4,
    effort: 1,
  },
} as const;
const frame = {
  case: "frame",
  value: {
    header: { vertexCount: 3, frameSeq: 1n, encoding: Encoding.RAW },
    frameSeq: 1n,
    vertexCount: 3,
    last: true,
    positions: new Uint8Array(36),
    distortion: new Uint8Array(12),
  },
} as const;
const result = [{ message: summary }, { message: frame }];

describe("solving", () => {
  test("takes along what waits and gives the result", async () => {
    const { server, session } = await begin();
    server.on.solve = async function* () {
      yield { message: { case: "progress", value: { iteration: 1, energy: 9, seconds: 0.5 } } };
      yield { message: summary };
      yield { message: { case: "trace", value: { records: [{ iteration: 1, energy: 9, objective: 4 }] } } };
      yield { message: frame };
    };
    const progress: number[] = [];
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    const solving = session.solve({ certify: true, trace: true, onProgress: ({ energy }) => progress.push(energy) });
    session.move("tip", at(1));
    const result = await solving;
    expect(result).toMatchObject({ energy: 3, iterations: 5, optimalityGap: 0.5, inputSeq: 2 });
    expect(result).toMatchObject({ minima: [4, 3], furtherStarts: 8, searchIterations: 4, effort: 1 });
    expect(result.positions.length).toBe(9);
    expect(result.trace).toMatchObject([{ iteration: 1, energy: 9, objective: 4 }]);
    expect(progress).toEqual([9]);
    expect(server.solves[0]).toMatchObject({ certify: true, trace: true, progress: true });
  });

  test("asks for progress only where somebody listens, and takes heartbeats for what they are", async () => {
    const { server, session } = await begin();
    server.on.solve = async function* () {
      yield { message: { case: "heartbeat", value: {} } };
      yield* result;
    };
    expect((await session.solve()).energy).toBe(3);
    expect(server.solves[0]!.progress).toBe(false);
  });

  test("goes on where onProgress throws", async () => {
    const { server, session } = await begin();
    const reported: unknown[] = [];
    vi.stubGlobal("reportError", (fault: unknown) => reported.push(fault));
    server.on.solve = async function* () {
      yield { message: { case: "progress", value: { iteration: 1, energy: 9, seconds: 0.5 } } };
      yield { message: summary };
      yield { message: frame };
    };
    const mistake = new TypeError("of the caller's");
    const onProgress = () => {
      throw mistake;
    };
    expect((await session.solve({ onProgress })).energy).toBe(3);
    expect(server.solves.length).toBe(1);
    expect(reported).toEqual([mistake]);
  });

  test("begins again where the server went away, and where it lost the session", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.solve = async function* ({ session: name }) {
      if (server.solves.length === 1) throw new ConnectError("away", Code.Unavailable);
      if (name === "sessions/1") throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
      yield { message: summary };
      yield { message: frame };
    };
    expect((await session.solve()).energy).toBe(3);
    expect(session.name).toBe("sessions/2");
    expect(server.updates.at(-1)!.session).toBe("sessions/2");
  });

  test("begins again where the server falls silent, and holds no update back for good", async () => {
    const server = new FakeServer();
    const rpc = server.rpc();
    rpc.longestSilenceMs = 300;
    const session = await openWith(rpc, triangle, {});
    opened.push(session);
    server.on.solve = async function* (_, { signal }) {
      if (server.solves.length === 1) await new Promise((resolve) => signal.addEventListener("abort", resolve));
      yield* result;
    };
    const solving = session.solve();
    await server.until(() => server.solves.length === 1);
    session.setHandle("tip", { vertices: [1] });
    expect((await solving).energy).toBe(3);
    expect(server.solves.map(({ update }) => update?.inputSeq)).toEqual([undefined, 1n]);
  });

  test("goes on for as long as heartbeats come", async () => {
    const server = new FakeServer();
    const rpc = server.rpc();
    rpc.longestSilenceMs = 400;
    const session = await openWith(rpc, triangle, {});
    opened.push(session);
    server.on.solve = async function* () {
      for (let k = 0; k < 8; ++k) {
        await new Promise((resolve) => setTimeout(resolve, 80));
        yield { message: { case: "heartbeat", value: {} } };
      }
      yield* result;
    };
    expect((await session.solve()).energy).toBe(3);
    expect(server.solves.length).toBe(1);
  });

  test("counts the time that it tries again from when the server went away", async () => {
    const server = new FakeServer();
    const { session } = await begin(server, server.rpc(5000, 300));
    server.on.solve = async function* () {
      if (server.solves.length === 1) {
        await new Promise((resolve) => setTimeout(resolve, 400));
        throw new ConnectError("away", Code.Unavailable);
      }
      yield* result;
    };
    expect((await session.solve()).energy).toBe(3);
  });

  test("gives the result of the newest update where the server went back to an older state", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.solve = async function* () {
      const inputSeq = server.updates.length === 1 ? 0n : 1n;
      yield { message: { case: "summary", value: { ...summary.value, inputSeq } } };
      yield { message: frame };
    };
    expect((await session.solve()).inputSeq).toBe(1);
    expect(server.solves.length).toBe(2);
    expect(server.updates[1]!.update).toMatchObject({ inputSeq: 1n, handles: [{ name: "tip" }] });
  });

  test("sends what the server did not keep before what waits, where the server went away", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.solve = async function* () {
      if (server.solves.length === 1) throw new ConnectError("killed", Code.Unavailable);
      yield* result;
    };
    const solving = session.solve();
    session.setHandle("base", { vertices: [0] });
    expect((await solving).inputSeq).toBe(2);
    expect(server.solves.map(({ update }) => update?.inputSeq)).toEqual([2n, 2n]);
    expect(server.updates[1]!.update).toMatchObject({ inputSeq: 1n, handles: [{ name: "tip" }] });
  });

  test("ends with what the server refuses, a result without positions, or an abort", async () => {
    const { server, session } = await begin();
    server.on.solve = async function* () {
      throw refusal("NO_HANDLES", {}, Code.FailedPrecondition);
    };
    await expect(session.solve()).rejects.toMatchObject({ code: "failed_precondition", reason: "NO_HANDLES" });
    server.on.solve = async function* () {
      yield { message: summary };
    };
    await expect(session.solve()).rejects.toMatchObject({ code: "data_loss" });
    server.on.solve = async function* (_, { signal }) {
      await new Promise((resolve) => signal.addEventListener("abort", resolve));
      yield { message: summary };
    };
    const abort = new AbortController();
    const solving = session.solve({ signal: abort.signal });
    await server.until(() => server.solves.length === 3);
    abort.abort();
    await expect(solving).rejects.toMatchObject({ code: "cancelled" });
    await expect(session.solve({ deadlineMs: 30 })).rejects.toMatchObject({ code: "deadline_exceeded" });
  });
});

describe("solving, while it waits,", () => {
  const away = () => {
    throw new ConnectError("away", Code.Unavailable);
  };

  test("for an update that is under way ends at once with an abort, and at its deadline", async () => {
    const { server, session } = await begin();
    let answer = () => {};
    const isAnswered = new Promise<void>((resolve) => (answer = resolve));
    server.on.update = () => isAnswered;
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    const abort = new AbortController();
    const solving = session.solve({ signal: abort.signal });
    abort.abort();
    await expect(solving).rejects.toMatchObject({ code: "cancelled" });
    await expect(session.solve({ deadlineMs: 50 })).rejects.toMatchObject({ code: "deadline_exceeded" });
    expect(server.solves).toEqual([]);
    session.move("tip", at(1)); // and holds nothing up any more
    answer();
    await server.until(() => server.updates.at(-1)!.update!.inputSeq === 2n);
  });

  test("for a server that is away ends at once with an abort, and at its deadline, however often it is tried", async () => {
    const { server, session } = await begin();
    server.on.solve = () => {
      throw refusal("DRAINING", {}, Code.Unavailable, server.solves.length < 6 ? 0 : 30_000);
    };
    const abort = new AbortController();
    const solving = session.solve({ signal: abort.signal });
    await server.until(() => server.solves.length === 6);
    const abortedAt = performance.now();
    abort.abort();
    await expect(solving).rejects.toMatchObject({ code: "cancelled" });
    expect(performance.now() - abortedAt).toBeLessThan(15_000); // it would wait for twice as long
    expect(server.solves.length).toBe(6);

    server.on.solve = away;
    const begun = performance.now();
    await expect(session.solve({ deadlineMs: 3000 })).rejects.toMatchObject({ code: "deadline_exceeded" });
    expect(performance.now() - begun).toBeLessThan(9000); // without a deadline it goes on for 10 s
    expect(server.solves.length).toBeGreaterThan(7);
  });

  test("tells each server that it tries how much of its time is left", async () => {
    const { server, session } = await begin();
    const left: number[] = [];
    server.on.solve = async function* (_, { timeoutMs }) {
      if (left.push(timeoutMs()!) < 4) away();
      yield* result;
    };
    await session.solve({ deadlineMs: 30_000 });
    expect(left.length).toBe(4);
    expect(left).toEqual(left.toSorted((a, b) => b - a));
    expect(left[0]).toBeLessThanOrEqual(30_000);
    expect(left[0]! - left[3]!).toBeGreaterThan(100); // the three pauses are of 175 ms at least
  });

  test("for a server that starts recreates the session that was lost", async () => {
    const { server, session } = await begin();
    server.on.solve = async function* ({ session: name }) {
      if (name === "sessions/1") throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
      yield* result;
    };
    server.on.create = (_, count) => {
      if (count <= 3) away();
    };
    expect((await session.solve()).energy).toBe(3);
    expect(server.creations.length).toBe(4);
    expect(new Set(server.creations.slice(1).map(({ requestId }) => requestId)).size).toBe(1);
  });

  test("for a session to be recreated ends at once with an abort, and with what refuses the mesh now", async () => {
    const { server, session } = await begin();
    server.on.solve = () => {
      throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
    };
    server.on.create = away;
    const abort = new AbortController();
    const solving = session.solve({ signal: abort.signal });
    await server.until(() => server.creations.length === 2);
    abort.abort();
    await expect(solving).rejects.toMatchObject({ code: "cancelled" });
    server.on.create = () => {
      throw refusal("MESH_TOO_LARGE", {});
    };
    await expect(session.solve()).rejects.toMatchObject({ reason: "MESH_TOO_LARGE" });
  });
});
