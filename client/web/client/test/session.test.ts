import { Code, ConnectError } from "@connectrpc/connect";
import { afterEach, describe, expect, test, vi } from "vitest";
import type { LpdeformError } from "../src/index.js";
import { Encoding } from "../src/gen/lpdeform/v1/frame_pb.js";
import { GoAwayReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { joinWith, openWith, type Session } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";

const opened: Session[] = [];

/** A session of a triangle, and the server that it is on; frames are asked for and the stream is open. */
async function begin(server = new FakeServer(), rpc = server.rpc()) {
  const session = await openWith(rpc, triangle, {});
  opened.push(session);
  session.poll();
  await server.until(() => server.streams.length > 0);
  server.stream.open();
  await connected(session);
  return { server, session, rpc };
}

/** Resolves when all that was sent on the stream so far has come. */
async function arrived(server: FakeServer, session: Session): Promise<void> {
  const mark = problems(session, 1);
  server.stream.send({ case: "fault", value: { reason: "MARK" } });
  await mark;
}

function connected(session: Session): Promise<void> {
  return new Promise((resolve) => {
    const stop = session.on("connection", (state) => {
      if (state !== "connected") return;
      stop();
      resolve();
    });
    if (session.connection === "connected") resolve();
  });
}

/** The next `count` of what the session reports. */
function problems(session: Session, count: number): Promise<LpdeformError[]> {
  const all: LpdeformError[] = [];
  return new Promise((resolve) => session.on("problem", (error) => all.push(error) === count && resolve(all)));
}

async function next(session: Session) {
  return (await session[Symbol.asyncIterator]().next()).value!;
}

const at = (x: number) => ({ translation: [x, 0, 0] as const });

afterEach(async () => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  await Promise.all(opened.splice(0).map((session) => session.close().catch(() => undefined)));
});

describe("frames", () => {
  test("are acknowledged when they are taken, and not before", async () => {
    const { server, session } = await begin();
    server.stream.frame({ frameSeq: 1n });
    server.stream.frame({ frameSeq: 2n }, { x: 2 });
    await arrived(server, session);
    expect(server.acks).toEqual([]);
    const frame = await next(session);
    expect(frame.frameSeq).toBe(2);
    expect(frame.positions[0]).toBe(2);
    await server.until(() => server.acks.length > 0);
    expect(server.acks[0]).toMatchObject({ session: "sessions/1", streamId: "stream1.0", frameSeq: 2n });
    expect(session.poll()).toBeUndefined();
  });

  test("of an older input or epoch are dropped, but their credit is given back", async () => {
    const { server, session } = await begin();
    server.stream.frame({ frameSeq: 1n, inputSeq: 5n, epoch: 2n });
    server.stream.frame({ frameSeq: 2n, inputSeq: 4n, epoch: 2n });
    server.stream.frame({ frameSeq: 3n, inputSeq: 9n, epoch: 1n });
    await server.until(() => server.acks.some(({ frameSeq }) => frameSeq === 3n));
    expect((await next(session)).frameSeq).toBe(1);
  });

  test("that were not taken count as skipped inputs of the next", async () => {
    const { server, session } = await begin();
    server.stream.frame({ frameSeq: 1n, skippedInputs: 2n });
    server.stream.frame({ frameSeq: 2n, skippedInputs: 3n });
    await arrived(server, session);
    expect(session.poll()!.skippedInputs).toBe(5);
  });

  test("end when the session is closed", async () => {
    const { server, session } = await begin();
    const reading = (async () => {
      for await (const _ of session);
      return "ended";
    })();
    await session.close();
    expect(await reading).toBe("ended");
    expect(session.connection).toBe("closed");
    expect(server.deleted).toEqual(["sessions/1"]);
    expect(server.stream.isAborted).toBe(true);
    await session.close();
    expect(server.deleted.length).toBe(1);
  });

  test("are asked for as the options say", async () => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, { credit: 5, encoding: "quantized", withNormals: true, maxFramesPerSecond: 24 });
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length > 0);
    expect(server.stream.request.streams[0]!.options).toMatchObject({
      credit: 5,
      encoding: Encoding.QUANTIZED,
      lowestEncoding: Encoding.QUANTIZED,
      withNormals: true,
      maxFramesPerSecond: 24,
    });
  });

  test("of two sessions come on one stream", async () => {
    const server = new FakeServer();
    const rpc = server.rpc();
    const [one, other] = await Promise.all([openWith(rpc, triangle, {}), openWith(rpc, triangle, {})]);
    opened.push(one, other);
    one.poll();
    other.poll();
    await server.until(() => server.streams.length > 0);
    expect(server.streams.length).toBe(1);
    expect(server.stream.request.streams.map(({ session }) => session).sort()).toEqual(["sessions/1", "sessions/2"]);
    const [first, second] = server.stream.request.streams[0]!.session === one.name ? [one, other] : [other, one];
    server.stream.open(0);
    server.stream.open(1);
    server.stream.frame({ frameSeq: 1n }, { stream: 1, x: 8 });
    expect((await next(second)).positions[0]).toBe(8);
    expect(first.poll()).toBeUndefined();
  });

  test("of a session that comes later make the stream be opened anew, and old credit is not given to it", async () => {
    const { server, session, rpc } = await begin();
    server.stream.frame({ frameSeq: 4n });
    await arrived(server, session);
    const other = await openWith(rpc, triangle, {});
    opened.push(other);
    other.poll();
    await server.until(() => server.streams.length === 2 && server.streams[0]!.isAborted);
    expect(server.stream.request.streams.length).toBe(2);
    server.stream.open(0);
    server.stream.open(1);
    server.stream.frame({ frameSeq: 1n }, { stream: 1 });
    await next(other);
    expect((await next(session)).frameSeq).toBe(4);
    await server.until(() => server.acks.length > 0);
    expect(server.acks.every(({ streamId }) => streamId === "stream2.1")).toBe(true);
  });
});

describe("updates", () => {
  test("made faster than they are taken are merged into one", async () => {
    const { server, session } = await begin();
    let answer = () => {};
    server.on.update = (_, count) => (count === 1 ? new Promise<void>((resolve) => (answer = resolve)) : undefined);
    session.setHandle("tip", { vertices: [1] });
    for (let x = 1; x <= 50; ++x) session.move("tip", at(x));
    await server.until(() => server.updates.length > 0);
    answer();
    await server.until(() => server.updates.length > 1);
    expect(server.updates[1]!.update).toMatchObject({ inputSeq: 51n, handles: [{ name: "tip" }] });
    expect(session.newestInput).toBe(51);
  });

  test("that are refused are reported once, with what is wrong", async () => {
    const { server, session } = await begin();
    server.on.update = () => {
      throw refusal("HANDLE_VERTEX_OUT_OF_RANGE", { element: "vertex 9", limit: "index < 3" });
    };
    const reported = problems(session, 1);
    session.setHandle("tip", { vertices: [9] });
    expect((await reported)[0]).toMatchObject({
      code: "invalid_argument",
      reason: "HANDLE_VERTEX_OUT_OF_RANGE",
      element: "vertex 9",
      limit: "index < 3",
      message: "No.",
    });
    expect(session.newestInput).toBe(0);
    delete server.on.update;
    session.setHandle("base", { vertices: [0] });
    await server.until(() => server.updates.length > 1);
    expect(server.updates[1]!.update!.handles.map(({ name }) => name)).toEqual(["base"]);
  });

  test("are sent again where the server is away, until it is back", async () => {
    const { server, session } = await begin();
    server.on.update = (_, count) => {
      if (count <= 3) throw new ConnectError("away", Code.Unavailable);
    };
    session.setHandle("tip", { vertices: [1] });
    session.move("tip", at(3));
    await server.until(() => server.updates.length === 4);
    expect(server.updates[3]!.update!.inputSeq).toBe(2n);
  });

  test("wait as long as a full server asks for", async () => {
    const { server, session } = await begin();
    server.on.update = (_, count) => {
      if (count === 1) throw refusal("SERVER_BUSY", {}, Code.ResourceExhausted, 300);
    };
    const start = performance.now();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 2);
    expect(performance.now() - start).toBeGreaterThan(290);
  });

  test("of a writer that was replaced are void, and takeOver() makes it the writer again", async () => {
    const { server, session } = await begin();
    server.on.update = ({ writerToken }) => {
      if (writerToken === "token") throw refusal("NOT_THE_WRITER", {}, Code.PermissionDenied);
    };
    const reported = problems(session, 1);
    session.setHandle("tip", { vertices: [1] });
    expect((await reported)[0]).toMatchObject({ code: "aborted", reason: "WRITER_REPLACED" });
    expect(() => session.move("tip", at(1))).toThrow(expect.objectContaining({ reason: "NOT_THE_WRITER" }));
    await session.takeOver();
    expect(session.setHandle("tip", { vertices: [1] })).toBe(41);
    await server.until(() => server.updates.at(-1)!.writerToken === "another");
  });

  test("are thrown back once closed", async () => {
    const { session } = await begin();
    await session.close();
    expect(() => session.set({ p: 2 })).toThrow(expect.objectContaining({ reason: "SESSION_CLOSED" }));
    await expect(session.solve()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
    await expect(session.settle()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
    await expect(session.takeOver()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
  });

  test("of a reader are thrown back", async () => {
    const server = new FakeServer();
    const session = await joinWith(server.rpc(), "sessions/1", {});
    opened.push(session);
    expect(() => session.set({ p: 2 })).toThrow(expect.objectContaining({ reason: "NOT_THE_WRITER" }));
    await session.close();
    expect(server.deleted).toEqual([]);
  });

  test("too large for one message go ahead in parts", async () => {
    const server = new FakeServer();
    const count = 200_000;
    const mesh = { vertices: new Float32Array(3 * count).map((_, k) => k % 1000), faces: new Uint32Array([0, 1, 2]) };
    opened.push(await openWith(server.rpc(), mesh, {}));
    const { data } = server.creations[0]!.mesh!;
    expect(data!.source.case).toBe("upload");
    const sent = server.uploads.get(data!.source.value as string)!;
    expect(sent.length).toBe(12 * count + 12);
    expect(new Float32Array(sent.buffer, 0, 3 * count)).toEqual(mesh.vertices);
    expect(new Uint32Array(sent.buffer, 12 * count)).toEqual(mesh.faces);
  });
});

describe("a stream that ends", () => {
  test("by a broken connection is taken up again", async () => {
    const { server, session } = await begin();
    const states: string[] = [];
    session.on("connection", (state) => states.push(state));
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    server.stream.frame({ frameSeq: 9n });
    expect((await next(session)).frameSeq).toBe(9);
    expect(states).toEqual(["reconnecting", "connected"]);
    expect(server.creations.length).toBe(1);
  });

  test("by draining is taken up again after the pause that was asked for", async () => {
    const { server } = await begin();
    const start = performance.now();
    server.stream.goAway(GoAwayReason.DRAINING, { reconnectAfterMs: 300 });
    server.stream.queue.finish();
    await server.until(() => server.streams.length === 2);
    expect(performance.now() - start).toBeGreaterThan(290);
  });

  test("by a frame that does not fit is taken up again", async () => {
    const { server, session } = await begin();
    server.stream.frame({ frameSeq: 1n, vertexCount: 8 });
    await server.until(() => server.streams.length === 2 && server.streams[0]!.isAborted);
    expect(session.connection).toBe("reconnecting");
  });

  test("by silence is taken up again", async () => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length > 0);
    server.stream.open(0, { heartbeatIntervalMs: 50 });
    await server.until(() => server.streams.length === 2);
    expect(server.streams[0]!.isAborted).toBe(true);
  });

  test("stays where heartbeats come", async () => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length > 0);
    server.stream.open(0, { heartbeatIntervalMs: 100 });
    for (let k = 0; k < 8; ++k) {
      await new Promise((resolve) => setTimeout(resolve, 80));
      server.stream.send({ case: "heartbeat", value: {} });
    }
    expect(server.streams.length).toBe(1);
  });

  test("by an acknowledgement that is refused is taken up again", async () => {
    const { server, session } = await begin();
    server.on.ack = () => {
      throw refusal("STREAM_UNKNOWN", {}, Code.NotFound);
    };
    server.stream.frame({ frameSeq: 1n });
    await next(session);
    await server.until(() => server.streams.length === 2);
  });

  test("with the session deleted is the end", async () => {
    const { server, session } = await begin();
    server.stream.goAway(GoAwayReason.SESSION_DELETED, { text: "The session was deleted." });
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({ code: "not_found", reason: "SESSION_DELETED", message: "The session was deleted." });
    expect(() => session.poll()).toThrow(expect.objectContaining({ reason: "SESSION_DELETED" }));
    expect(session.connection).toBe("closed");
  });

  test("for a fault of ours is the end", async () => {
    const { server, session } = await begin();
    server.stream.goAway(GoAwayReason.PROTOCOL_ERROR);
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({ code: "internal", reason: "PROTOCOL_ERROR" });
  });

  test("and stays away for too long is the end, with what stood in the way", async () => {
    const server = new FakeServer();
    const { session } = await begin(server, server.rpc(5000, 400));
    server.on.stream = (stream) => stream.queue.finish(new ConnectError("still away", Code.Unavailable));
    server.stream.queue.finish(new ConnectError("away", Code.Unavailable));
    await expect(next(session)).rejects.toMatchObject({ code: "unavailable", message: "still away" });
  });
});

describe("a session that the server has lost", () => {
  test("is made anew from mesh, handles and settings as they were accepted", async () => {
    const { server, session } = await begin();
    session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    await server.until(() => server.updates.length === 1);
    session.move("tip", at(3));
    session.set({ p: 1.5 });
    server.on.solve = async function* () {
      throw refusal("COMPONENT_WITHOUT_HANDLE", {}, Code.FailedPrecondition);
    };
    await session.solve().catch(() => undefined); // then all updates are answered
    const sent = server.updates.length;
    server.on.stream = (stream) => {
      if (stream.request.streams[0]!.session === "sessions/1") {
        const fault = { code: Code.NotFound, reason: "SESSION_UNKNOWN", text: "There is no such session." };
        stream.send({ case: "fault", value: fault });
        stream.goAway(GoAwayReason.NOT_OPENED);
        stream.queue.finish();
      } else {
        stream.open();
      }
    };
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.updates.length === sent + 1);
    expect(server.creations.length).toBe(2);
    expect(server.creations[1]!.mesh).toEqual(server.creations[0]!.mesh);
    expect(server.creations[1]!.requestId).not.toBe(server.creations[0]!.requestId);
    expect(session.name).toBe("sessions/2");
    const { session: name, update } = server.updates.at(-1)!;
    expect(name).toBe("sessions/2");
    expect(update!.handles.map(({ name }) => name)).toEqual(["base", "tip"]);
    expect(update!.handles[1]!.change.value).toMatchObject({ motion: { kind: { case: "rigid", value: { translation: { x: 3 } } } } });
    expect(update!.settings!.p!.value).toEqual({ case: "uniform", value: 1.5 });
    server.stream.frame({ frameSeq: 1n, inputSeq: 3n });
    expect((await next(session)).frameSeq).toBe(1);
  });

  test("is noticed by an update as well, which then comes after what was accepted", async () => {
    const { server, session } = await begin();
    session.setHandle("base", { vertices: [0] });
    await server.until(() => server.updates.length === 1);
    server.on.update = ({ session: name }) => {
      if (name === "sessions/1") throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
    };
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 4);
    expect(server.updates.slice(2).map(({ session: name, update }) => [name, update!.handles[0]!.name])).toEqual([
      ["sessions/2", "base"],
      ["sessions/2", "tip"],
    ]);
    expect(server.creations.length).toBe(2);
  });

  test("by expiring is made anew", async () => {
    const { server } = await begin();
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await server.until(() => server.streams.length === 2);
    expect(server.stream.request.streams[0]!.session).toBe("sessions/2");
  });

  test("is asked for with the same id until the server answers", async () => {
    const { server } = await begin();
    server.on.create = (_, count) => {
      if (count <= 3) throw new ConnectError("starting", Code.Unavailable);
    };
    server.on.stream = (stream) => {
      if (stream.request.streams[0]!.session !== "sessions/1") return;
      stream.send({ case: "fault", value: { code: Code.NotFound, reason: "SESSION_UNKNOWN" } });
      stream.goAway(GoAwayReason.NOT_OPENED);
      stream.queue.finish();
    };
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.creations.length === 4);
    expect(new Set(server.creations.slice(1).map(({ requestId }) => requestId)).size).toBe(1);
  });

  test("and refuses the mesh now is the end", async () => {
    const { server, session } = await begin();
    server.on.create = () => {
      throw refusal("MESH_TOO_LARGE", {});
    };
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({ reason: "MESH_TOO_LARGE" });
  });

  test("was somebody else's is the end", async () => {
    const server = new FakeServer();
    const session = await joinWith(server.rpc(), "sessions/1", { role: "writer" });
    opened.push(session);
    expect(session.setHandle("tip", { vertices: [1] })).toBe(41);
    session.poll();
    await server.until(() => server.streams.length > 0);
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({ reason: "SESSION_EXPIRED" });
  });
});

describe("a hidden page", () => {
  const page = Object.assign(new EventTarget(), { hidden: false });
  const show = (hidden: boolean) => {
    page.hidden = hidden;
    page.dispatchEvent(new Event("visibilitychange"));
  };

  /** A session on a page, which may be hidden; clocks stand still. */
  async function beginOnPage() {
    vi.stubGlobal("document", page);
    page.hidden = false;
    vi.useFakeTimers({ toFake: ["setInterval", "clearInterval"] });
    return begin();
  }

  test("gives its connection back when nothing is under way, until it is seen again", async () => {
    const { server, session } = await beginOnPage();
    server.stream.frame({ frameSeq: 1n, converged: true });
    await arrived(server, session);
    show(true);
    vi.advanceTimersByTime(60_000);
    await server.until(() => server.stream.isAborted);
    expect(session.connection).toBe("idle");
    expect(server.streams.length).toBe(1);
    show(false);
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    await connected(session);
  });

  test("keeps it while a frame is to come, and takes it again for an update", async () => {
    const { server, session } = await beginOnPage();
    session.setHandle("tip", { vertices: [1] });
    server.stream.frame({ frameSeq: 1n, converged: true });
    await arrived(server, session);
    show(true);
    vi.advanceTimersByTime(60_000);
    expect(session.connection).toBe("connected");
    server.stream.frame({ frameSeq: 2n, inputSeq: 1n, converged: true });
    await arrived(server, session);
    vi.advanceTimersByTime(60_000);
    expect(session.connection).toBe("idle");
    session.move("tip", at(1));
    await server.until(() => server.streams.length === 2);
    expect(page.hidden).toBe(true);
  });
});

describe("settling", () => {
  test("waits for the finished frame of the newest update", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    const settled = session.settle();
    server.stream.frame({ frameSeq: 1n, inputSeq: 0n, converged: true });
    await server.until(() => server.acks.length === 1);
    server.stream.frame({ frameSeq: 2n, inputSeq: 1n });
    await server.until(() => server.acks.length === 2);
    server.stream.frame({ frameSeq: 3n, inputSeq: 1n, converged: true });
    expect((await settled).frameSeq).toBe(3);
  });

  test("ends with a problem, a deadline, or an abort", async () => {
    const { server, session } = await begin();
    const fault = { code: Code.FailedPrecondition, reason: "COMPONENT_WITHOUT_HANDLE", element: "component 1", inputSeq: 1n };
    const settled = session.settle();
    server.stream.send({ case: "fault", value: fault });
    await expect(settled).rejects.toMatchObject({ reason: "COMPONENT_WITHOUT_HANDLE", element: "component 1", inputSeq: 1 });
    await expect(session.settle({ timeoutMs: 20 })).rejects.toMatchObject({ code: "deadline_exceeded", reason: "NO_FRAME" });
    await expect(session.settle({ signal: AbortSignal.abort() })).rejects.toMatchObject({ code: "cancelled" });
  });
});

describe("solving", () => {
  const summary = { case: "summary", value: { energy: 3, iterations: 5, inputSeq: 2n, certificate: { relativeGap: 0.5 } } } as const;
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
    expect(result.positions.length).toBe(9);
    expect(result.trace).toMatchObject([{ iteration: 1, energy: 9, objective: 4 }]);
    expect(progress).toEqual([9]);
    expect(server.solves[0]).toMatchObject({ certify: true, trace: true, progress: true });
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

describe("opening", () => {
  test("says what is wrong with the mesh", async () => {
    const server = new FakeServer();
    const halves = { vertices: [0, 0, 0, 1], faces: [0, 0, 0] };
    await expect(openWith(server.rpc(), halves, {})).rejects.toMatchObject({ reason: "MESH_SIZE", element: "vertices" });
    await expect(openWith(server.rpc(), { ...triangle, faces: [0, 1] }, {})).rejects.toMatchObject({ element: "faces" });
    server.on.create = () => {
      throw refusal("MESH_NOT_FINITE", { element: "vertex 1" });
    };
    await expect(openWith(server.rpc(), triangle, {})).rejects.toMatchObject({ reason: "MESH_NOT_FINITE", element: "vertex 1" });
  });
});

/** An error as the server makes it. */
function refusal(reason: string, metadata: Record<string, string>, code = Code.InvalidArgument, retryMs = 0): ConnectError {
  const error = new ConnectError("No.", code);
  const field = (number: number, bytes: Uint8Array) => [8 * number + 2, bytes.length, ...bytes];
  const text = (value: string) => new TextEncoder().encode(value);
  const entries = Object.entries(metadata).flatMap(([key, value]) =>
    field(3, new Uint8Array([...field(1, text(key)), ...field(2, text(value))])),
  );
  const info = new Uint8Array([...field(1, text(reason)), ...entries]);
  error.details.push({ type: "google.rpc.ErrorInfo", value: info });
  const nanos = retryMs * 1e6;
  const varint = (value: number): number[] => (value < 128 ? [value] : [(value % 128) | 128, ...varint(Math.floor(value / 128))]);
  const duration = new Uint8Array([16, ...varint(nanos)]);
  if (retryMs > 0) error.details.push({ type: "google.rpc.RetryInfo", value: new Uint8Array(field(1, duration)) });
  return error;
}
