import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test, vi } from "vitest";
import { GoAwayReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { openWith } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";
import { arrived, at, begin, connected, gate, next, opened, refusal } from "./harness.js";

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

  test("by a frame that never fits is taken up again ever more slowly, and is the end after five", async () => {
    const server = new FakeServer();
    server.on.stream = (stream) => {
      stream.open();
      stream.frame({ frameSeq: 1n, vertexCount: 8 });
    };
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    const start = performance.now();
    await expect(next(session)).rejects.toMatchObject({ code: "data_loss", reason: "FRAME_PARTS" });
    expect(server.streams.length).toBe(5);
    expect(performance.now() - start).toBeGreaterThan((50 + 100 + 200 + 400) / 2);
    expect(session.connection).toBe("closed");
    await session.takeOver();
    await expect(next(session)).rejects.toMatchObject({ reason: "FRAME_PARTS" });
    expect(server.streams.length).toBe(10);
  });

  test("by frames that do not fit goes on where one has fitted in between", async () => {
    const server = new FakeServer();
    server.on.stream = (stream, count) => {
      stream.open();
      if (count % 3 === 0) stream.frame({ frameSeq: BigInt(count) });
      if (count < 8) stream.frame({ frameSeq: BigInt(count + 1), vertexCount: 8 });
    };
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length === 8);
    await connected(session);
  });

  test("for one session by a frame that does not fit goes on for the others", async () => {
    const { server, session, rpc } = await begin();
    const other = await openWith(rpc, triangle, {});
    opened.push(other);
    other.poll();
    await server.until(() => server.streams.length === 2);
    server.stream.open(0);
    server.stream.open(1);
    await Promise.all([connected(session), connected(other)]);
    const states: string[] = [];
    other.on("connection", (state) => states.push(state));
    server.stream.frame({ frameSeq: 1n, vertexCount: 8 });
    server.stream.frame({ frameSeq: 2n }, { stream: 1 });
    expect((await next(other)).frameSeq).toBe(2);
    expect(session.connection).toBe("reconnecting");
    await server.until(() => server.streams.length === 3);
    expect(server.stream.request.streams.length).toBe(2);
    expect(states).toEqual([]);
  });

  test("by a frame that does not fit leaves no timer behind", async () => {
    const { server, session } = await begin();
    const [begun, ended] = [vi.spyOn(globalThis, "setTimeout"), vi.spyOn(globalThis, "clearTimeout")];
    server.stream.open(0, { heartbeatIntervalMs: 12_345 });
    await arrived(server, session);
    server.stream.frame({ frameSeq: 1n, vertexCount: 8 });
    await server.until(() => server.streams[0]!.isAborted);
    const ofSilence = begun.mock.calls.flatMap(([, ms], k) =>
      ms === 3 * 12_345 ? [begun.mock.results[k]!.value] : [],
    );
    const cleared = ended.mock.calls.map(([timer]) => timer);
    vi.restoreAllMocks();
    expect(ofSilence.length).toBeGreaterThan(0);
    expect(ofSilence.filter((timer) => !cleared.includes(timer))).toEqual([]);
  });

  test("for good is not opened again, however often it is asked for", async () => {
    const { server, session, rpc } = await begin();
    server.stream.goAway(GoAwayReason.PROTOCOL_ERROR);
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({ reason: "PROTOCOL_ERROR" });
    for (let k = 0; k < 3; ++k)
      expect(() => session.poll()).toThrow(expect.objectContaining({ reason: "PROTOCOL_ERROR" }));
    const other = await openWith(rpc, triangle, {});
    opened.push(other);
    other.poll();
    await server.until(() => server.streams.length === 2);
    expect(server.stream.request.streams.map(({ session: name }) => name)).toEqual(["sessions/2"]);
  });

  test("by silence is taken up again", async () => {
    const server = new FakeServer();
    const rpc = server.rpc();
    const session = await openWith(rpc, triangle, {});
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length > 0);
    server.stream.open(0, { heartbeatIntervalMs: 50 });
    await server.until(() => server.streams.length === 2);
    expect(server.streams[0]!.isAborted).toBe(true);
    expect(rpc.longestSilenceMs).toBe(150); // what a solve may be silent for as well
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

  test("for another session to come along is not taken for a broken one, though an acknowledgement is on its way", async () => {
    const { server, session, rpc } = await begin();
    const answer = gate();
    server.on.ack = async () => {
      await answer.isOpen;
      throw refusal("STREAM_UNKNOWN", {}, Code.NotFound);
    };
    server.stream.frame({ frameSeq: 1n });
    await next(session);
    await server.until(() => server.acks.length === 1);
    const other = await openWith(rpc, triangle, {});
    opened.push(other);
    other.poll();
    await server.until(() => server.streams.length === 2); // and is not open yet
    answer.open();
    const states: string[] = [];
    session.on("connection", (state) => states.push(state));
    await new Promise((resolve) => setTimeout(resolve, 50));
    server.stream.open(0);
    server.stream.open(1);
    await connected(other);
    expect(server.acks.map(({ streamId }) => streamId)).toEqual(["stream1.0"]);
    expect([states, server.streams.length]).toEqual([[], 2]);
  });

  test("with the session deleted is the end", async () => {
    const { server, session } = await begin();
    server.stream.goAway(GoAwayReason.SESSION_DELETED, { text: "The session was deleted." });
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject({
      code: "not_found",
      reason: "SESSION_DELETED",
      message: "The session was deleted.",
    });
    expect(() => session.poll()).toThrow(expect.objectContaining({ reason: "SESSION_DELETED" }));
    expect(session.connection).toBe("closed");
    expect(() => session.set({ p: 2 })).toThrow(expect.objectContaining({ reason: "SESSION_DELETED" }));
    expect(server.updates).toEqual([]);
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

describe("a server that was away for a moment", () => {
  const blip = new ConnectError("away", Code.Unavailable);

  /** A session that gives up after 300 ms; its first update meets a blip, `then` what the server answers after that. */
  async function beginWithBlip(then: () => void) {
    const server = new FakeServer();
    const { session } = await begin(server, server.rpc(5000, 300));
    session.on("problem", () => undefined);
    server.on.update = (_, count) => {
      if (count === 1) throw blip;
      then();
    };
    session.move("tip", at(1));
    await server.until(() => server.updates.length >= 2);
    await new Promise((resolve) => setTimeout(resolve, 400));
    return { server, session };
  }

  test.each([
    ["takes the update", () => undefined],
    [
      "refuses the update",
      () => {
        throw refusal("HANDLE_UNKNOWN", {}, Code.NotFound);
      },
    ],
    [
      "cannot solve for it yet",
      () => {
        throw refusal("NO_HANDLES", {}, Code.FailedPrecondition);
      },
    ],
    [
      "is full",
      () => {
        throw refusal("SERVER_BUSY", {}, Code.ResourceExhausted, 900);
      },
    ],
  ])("and %s is not away when its stream breaks later", async (_, then) => {
    const { server, session } = await beginWithBlip(then);
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    await connected(session);
  });

  test("and is tried again later is not away when its stream breaks before that", async () => {
    const server = new FakeServer();
    const { session } = await begin(server, server.rpc(5000, 300));
    server.on.update = (_, count) => {
      if (count === 1) throw refusal("DRAINING", {}, Code.Unavailable, 900);
    };
    session.move("tip", at(1));
    await new Promise((resolve) => setTimeout(resolve, 400));
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    await connected(session);
    await server.until(() => server.updates.length === 2);
  });
});

describe("a session that is taken over", () => {
  test("does not wait for the pause between two tries", async () => {
    const { server, session } = await begin();
    server.stream.queue.finish(refusal("SERVER_BUSY", {}, Code.ResourceExhausted, 30_000));
    await new Promise((resolve) => setTimeout(resolve, 50));
    const start = performance.now();
    await session.takeOver();
    await server.until(() => server.streams.length === 2);
    expect(performance.now() - start).toBeLessThan(15_000);
  });

  test("is not recreated for what went before", async () => {
    const { server, session } = await begin();
    server.stream.queue.finish(refusal("SESSION_UNKNOWN", {}, Code.NotFound));
    await new Promise((resolve) => setTimeout(resolve, 5));
    await session.takeOver();
    await server.until(() => server.streams.length === 2);
    expect(server.creations.length).toBe(1);
  });

  test("sends what waits at once", async () => {
    const { server, session } = await begin();
    server.on.update = (_, count) => {
      if (count === 1) throw refusal("SERVER_BUSY", {}, Code.ResourceExhausted, 30_000);
    };
    session.move("tip", at(1));
    await server.until(() => server.updates.length === 1);
    await new Promise((resolve) => setTimeout(resolve, 50));
    const start = performance.now();
    await session.takeOver();
    await server.until(() => server.updates.length === 2);
    expect(performance.now() - start).toBeLessThan(15_000);
    expect(server.updates[1]!.writerToken).toBe("another");
  });
});

describe("a server that speaks of another mesh", () => {
  const another = { code: "data_loss", reason: "FRAME_VERTICES", limit: "vertices = 3" };

  test("when the session is made is refused", async () => {
    const server = new FakeServer();
    server.vertexCount = 4;
    await expect(openWith(server.rpc(), triangle, {})).rejects.toMatchObject({
      ...another,
      message: "The server speaks of 4 vertices of a mesh that has 3.",
    });
  });

  test("when a stream opens ends the session, and no other of the page", async () => {
    const { server, session, rpc } = await begin();
    const other = await openWith(rpc, triangle, {});
    opened.push(other);
    other.poll();
    await server.until(() => server.streams.length === 2);
    server.stream.open(0, { vertexCount: 4_000_000_000 });
    server.stream.open(1);
    await expect(next(session)).rejects.toMatchObject(another);
    expect(() => session.set({ p: 2 })).toThrow(expect.objectContaining(another));
    server.stream.frame({ frameSeq: 1n }, { stream: 1 });
    expect((await next(other)).frameSeq).toBe(1);
    expect(server.streams.length).toBe(2);
  });

  test("when the session is recreated ends it", async () => {
    const { server, session } = await begin();
    server.vertexCount = 2;
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await expect(next(session)).rejects.toMatchObject(another);
    expect(server.creations.length).toBe(2);
    expect(server.streams.length).toBe(1);
  });
});

describe("a server that went back to an older state", () => {
  const namesIn = (server: FakeServer, k: number) => server.updates[k]!.update!.handles.map(({ name }) => name);

  /** Has an update that the server took and did not keep. */
  async function beginUnkept() {
    const begun = await begin();
    begun.session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    await begun.server.until(() => begun.server.updates.length === 1);
    begun.server.isKeeping = true;
    return begun;
  }

  test("is told what it lost before what comes after, which waits for that", async () => {
    const { server, session } = await beginUnkept();
    server.stream.queue.finish(new ConnectError("killed", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    session.move("tip", at(1)); // the server is back, the stream is not
    await new Promise((resolve) => setTimeout(resolve, 50));
    expect(server.updates.length).toBe(1);
    server.stream.open(0, { inputSeq: 0n });
    await server.until(() => server.updates.length === 3);
    expect([namesIn(server, 1), namesIn(server, 2)]).toEqual([["base", "tip"], ["tip"]]);
    expect(server.updates.map(({ update }) => update!.inputSeq)).toEqual([1n, 1n, 2n]);
  });

  test("is told what it lost where only its epoch tells, for an update was there before the stream", async () => {
    const { server } = await beginUnkept();
    server.stream.queue.finish(new ConnectError("killed", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    server.stream.open(0, { epoch: 2n, inputSeq: 1n });
    await server.until(() => server.updates.length === 2);
    expect(namesIn(server, 1)).toEqual(["base", "tip"]);
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable)); // the same server: nothing is to be told
    await server.until(() => server.streams.length === 3);
    server.stream.open(0, { epoch: 2n, inputSeq: 1n });
    await connected(opened.at(-1)!);
    expect(server.updates.length).toBe(2);
  });

  test("is told what it lost where there is no stream", async () => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    await server.until(() => server.updates.length === 1);
    server.on.update = (_, count) => {
      if (count === 2) throw new ConnectError("killed", Code.Unavailable);
    };
    session.move("tip", at(1));
    await server.until(() => server.updates.length === 4);
    expect([namesIn(server, 2), namesIn(server, 3)]).toEqual([["base", "tip"], ["tip"]]);
  });
});

describe("a stream whose token has expired", () => {
  test("is opened again at once, and says why", async () => {
    const { server, session } = await begin();
    server.stream.goAway(GoAwayReason.TOKEN_EXPIRED, { text: "Come back with a new token." });
    server.stream.queue.finish();
    await server.until(() => server.streams.length === 2);
    expect(session.interruption).toMatchObject({ code: "unauthenticated", reason: "TOKEN_EXPIRED" });
    server.stream.open();
    await connected(session);
  });
});

describe("a listener that throws", () => {
  const mistake = new TypeError("of the caller's");

  /** What the page is told. */
  function faults(): unknown[] {
    const all: unknown[] = [];
    vi.stubGlobal("reportError", (fault: unknown) => all.push(fault));
    return all;
  }

  test("to a change of the connection does not keep the stream from being taken up again", async () => {
    const { server, session } = await begin();
    const reported = faults();
    const states: string[] = [];
    const stop = session.on("connection", () => {
      throw mistake;
    });
    session.on("connection", (state) => states.push(state));
    server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    server.stream.frame({ frameSeq: 9n });
    expect((await next(session)).frameSeq).toBe(9);
    expect(states).toEqual(["reconnecting", "connected"]);
    expect(reported).toEqual([mistake, mistake]);
    stop();
  });

  test("to a problem does not keep updates and frames from going on", async () => {
    const { server, session } = await begin();
    const reported = faults();
    session.on("problem", () => {
      throw mistake;
    });
    server.on.update = (_, count) => {
      if (count === 1) throw refusal("HANDLE_VERTEX_OUT_OF_RANGE", {});
    };
    session.setHandle("tip", { vertices: [9] });
    await server.until(() => server.updates.length === 1);
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 2);
    server.stream.send({ case: "fault", value: { reason: "NO_HANDLES" } });
    server.stream.frame({ frameSeq: 1n });
    expect((await next(session)).frameSeq).toBe(1);
    expect(server.streams.length).toBe(1);
    expect(reported).toEqual([mistake, mistake]);
  });
});
