import { create } from "@bufbuild/protobuf";
import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test } from "vitest";
import { changesFromWire } from "../src/fromwire.js";
import { Encoding } from "../src/gen/lpdeform/v1/frame_pb.js";
import { GoAwayReason, NoticeReason, UndoUpdateResponseSchema } from "../src/gen/lpdeform/v1/service_pb.js";
import { Packer } from "../src/packer.js";
import { joinWith, openWith, restoreWith } from "../src/session.js";
import { updateToWire } from "../src/towire.js";
import type { HandleChange, Hold } from "../src/types.js";
import { FakeServer, triangle } from "./fake_server.js";
import { arrived, at, begin, gate, opened, refusal } from "./harness.js";

const backTo = (x: number) => ({
  changes: [
    {
      name: "tip",
      change: {
        case: "move" as const,
        value: { kind: { case: "rigid" as const, value: { translation: { x, y: 0, z: 0 } } } },
      },
    },
  ],
  undoSteps: 1,
  redoSteps: 1,
});

describe("a better shape", () => {
  const notice = (inputSeq: bigint) => ({
    case: "notice" as const,
    value: { reason: NoticeReason.BETTER_SHAPE, text: "Better.", inputSeq, energy: 3, savedShare: 0.25 },
  });
  const overloaded = { reason: "overloaded", text: "Too much." };
  /** Of a triangle, as a solve gives it. */
  const surface = {
    header: { vertexCount: 3, frameSeq: 1n, encoding: Encoding.RAW },
    frameSeq: 1n,
    vertexCount: 3,
    last: true,
    positions: new Uint8Array(36),
    distortion: new Uint8Array(12),
  };

  /** A session that was told of a better shape for update 1, on a server that is overloaded. */
  async function told() {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    server.stream.send({ case: "notice", value: { reason: NoticeReason.OVERLOADED, text: "Too much." } });
    server.stream.frame({ frameSeq: 1n, inputSeq: 1n, energy: 4, isFinal: true });
    server.stream.send(notice(1n));
    await arrived(server, session);
    const heard: unknown[] = [];
    session.on("notice", (said) => heard.push(said));
    return { server, session, heard };
  }

  test("is announced with its energy and what it saves, and taken once, with what the server says of it", async () => {
    const { server, session, heard } = await told();
    expect(session.notice).toEqual({
      reason: "better_shape",
      text: "Better.",
      inputSeq: 1,
      energy: 3,
      savedShare: 0.25,
    });
    server.on.better = () => ({ inputSeq: 1n, energy: 3 });
    expect(await session.takeBetterShape()).toEqual({ inputSeq: 1, energy: 3 });
    expect(server.betters).toMatchObject([{ session: "sessions/1", writerToken: "token" }]);
    expect([session.notice, heard]).toEqual([overloaded, [overloaded]]);
  });

  test.each([
    ["stays while the same result comes again, with its certificate", { inputSeq: 1n, energy: 4 }, "better_shape"],
    ["ends when a frame shows the shape, also if another writer took it", { inputSeq: 1n, energy: 3 }, "overloaded"],
    ["ends when there is a frame for a later update", { inputSeq: 2n, energy: 9 }, "overloaded"],
  ])("%s", async (_, header, reason) => {
    const { server, session, heard } = await told();
    server.stream.frame({ frameSeq: 2n, isFinal: true, ...header });
    await arrived(server, session);
    expect([session.notice?.reason, heard.length]).toEqual([reason, reason === "overloaded" ? 1 : 0]);
  });

  test("ends with a solve of the same update, after which the server searches again, and stays where that fails", async () => {
    const { server, session, heard } = await told();
    server.on.solve = async function* () {
      throw refusal("OUT_OF_MEMORY", {}, Code.ResourceExhausted);
    };
    await expect(session.solve()).rejects.toMatchObject({ code: "resource_exhausted" });
    expect([session.notice?.reason, heard]).toEqual(["better_shape", []]);
    server.on.solve = async function* () {
      yield { message: { case: "summary", value: { energy: 4, inputSeq: 1n } } };
      expect([session.notice?.reason, heard]).toEqual(["overloaded", [overloaded]]);
      yield { message: { case: "frame", value: surface } };
    };
    expect((await session.solve()).energy).toBe(4);
    expect(heard.length).toBe(1);
  });

  test("does not hide for ever what the server says of itself meanwhile", async () => {
    const { server, session, heard } = await told();
    server.stream.send({ case: "notice", value: { reason: NoticeReason.RECOVERED, text: "No more." } });
    await arrived(server, session);
    expect([session.notice?.reason, heard]).toEqual(["better_shape", [{ reason: "recovered", text: "No more." }]]);
    server.stream.frame({ frameSeq: 2n, inputSeq: 2n });
    await arrived(server, session);
    expect(session.notice?.reason).toBe("recovered");
  });

  test("that is not there any more is an error, after which it is not announced any more either", async () => {
    const { server, session } = await told();
    server.on.better = () => {
      throw refusal("NO_BETTER_SHAPE", {}, Code.FailedPrecondition);
    };
    const error = { code: "failed_precondition", reason: "NO_BETTER_SHAPE" };
    await expect(session.takeBetterShape()).rejects.toMatchObject(error);
    expect(session.notice).toEqual(overloaded);
  });

  test("is asked for once only, because a call that was carried out leaves nothing to a second one", async () => {
    const { server, session } = await told();
    server.on.better = () => {
      throw new ConnectError("away", Code.Unavailable);
    };
    await expect(session.takeBetterShape()).rejects.toMatchObject({ code: "unavailable" });
    expect([server.betters.length, session.notice?.reason]).toEqual([1, "better_shape"]);
  });

  test("is refused to readers without a call, and once the session is closed", async () => {
    const server = new FakeServer();
    const session = await joinWith(server.rpc(), "sessions/1", {});
    opened.push(session);
    await expect(session.takeBetterShape()).rejects.toMatchObject({ reason: "NOT_THE_WRITER" });
    await session.close();
    await expect(session.takeBetterShape()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
    expect(server.betters).toEqual([]);
  });
});

describe("undo", () => {
  test("goes after all updates before it, and is part of what a session recreated gets", async () => {
    const { server, session } = await begin();
    const answer = gate();
    server.on.update = (_, count) => (count === 1 ? answer.isOpen : undefined);
    server.on.undo = () => backTo(5);
    session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    session.move("tip", at(9));
    const undone = session.undo();
    await server.until(() => server.updates.length === 1);
    expect(server.undos).toEqual([]);
    answer.open();
    expect(await undone).toBe(3);
    expect(server.updates.map(({ update }) => update!.inputSeq)).toEqual([1n, 2n]);
    expect(server.undos).toMatchObject([{ session: "sessions/1", writerToken: "token", inputSeq: 3n, redo: false }]);
    expect(session.newestInput).toBe(3);

    server.on.stream = (stream) => stream.open();
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await server.until(() => server.updates.length === 3);
    const [, tip] = server.updates[2]!.update!.handles;
    expect(tip!.change.value).toMatchObject({ motion: { kind: { value: { translation: { x: 5 } } } } });
    expect(server.updates[2]!.update!.inputSeq).toBe(3n);
  });

  test("is asked for again without what the server has, which would be a step to it", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.inputSeq = 1n;
    server.on.undo = (_, count) => {
      if (count <= 2) throw new ConnectError("away", Code.Unavailable);
      return backTo(0);
    };
    expect(await session.redo()).toBe(2);
    expect([server.undos.length, server.updates.length]).toEqual([3, 1]);
  });

  test("is asked for again where the server went away, as the same call, after what that has lost", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.undo = (_, count) => {
      if (count <= 2) throw new ConnectError("away", Code.Unavailable);
      return backTo(0);
    };
    expect(await session.redo()).toBe(2);
    expect(server.undos.map(({ inputSeq, redo }) => [inputSeq, redo])).toEqual(Array(3).fill([2n, true]));
    expect(server.updates.length).toBe(3);
    expect(server.updates[1]!.update).toMatchObject({ inputSeq: 1n, handles: [{ name: "tip" }] });
  });

  test("in a session that was recreated takes back what came after that, and not all its handles", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.stream = (stream) => stream.open();
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await server.until(() => server.updates.length === 2);
    server.undoSteps = 1;
    await expect(session.undo()).rejects.toMatchObject({ code: "failed_precondition", reason: "NOTHING_TO_UNDO" });
    expect(server.undos).toEqual([]);
    server.undoSteps = 2;
    server.on.undo = (_, count) => {
      server.undoSteps = 1;
      if (count === 1) throw new ConnectError("it was taken, and the answer is lost", Code.Unavailable);
      return {};
    };
    await session.undo();
    await session.redo();
    expect(server.undos.map(({ redo }) => redo)).toEqual([false, false, true]);
  });

  test("is not done to a session that was recreated while the server was away", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.on.stream = (stream) => stream.open();
    server.on.undo = () => {
      server.streams[0]!.goAway(GoAwayReason.SESSION_EXPIRED);
      server.streams[0]!.queue.finish();
      throw new ConnectError("away", Code.Unavailable);
    };
    server.on.update = async () => server.until(() => server.streams.length === 2); // it is recreated by then
    await expect(session.undo()).rejects.toMatchObject({ code: "not_found", reason: "SESSION_UNKNOWN" });
    expect(server.undos.length).toBe(1);
  });

  test("holds updates and solves back until it is answered, and comes after solves before it", async () => {
    const { server, session } = await begin();
    const solved = gate();
    server.on.solve = async function* () {
      await solved.isOpen;
      throw refusal("NO_HANDLES", {}, Code.FailedPrecondition);
    };
    const first = session.solve().catch(() => "first");
    await server.until(() => server.solves.length === 1);
    const undone = session.undo();
    const redone = session.redo();
    session.move("tip", at(1));
    const second = session.solve().catch(() => "second");
    await new Promise((resolve) => setTimeout(resolve, 20));
    expect(server.undos).toEqual([]);
    solved.open();
    expect(await Promise.all([first, undone, redone, second])).toEqual([
      "first",
      expect.any(Number),
      expect.any(Number),
      "second",
    ]);
    expect(server.undos.map(({ redo }) => redo)).toEqual([false, true]);
  });

  test("after an update that is refused says so", async () => {
    const server = new FakeServer();
    const session = await openWith(server.rpc(), triangle, {});
    opened.push(session);
    const first = gate();
    server.on.update = (_, count) => {
      if (count === 1) return first.isOpen;
      throw refusal("HANDLE_VERTEX_OUT_OF_RANGE", {});
    };
    session.setHandle("tip", { vertices: [1] });
    session.setHandle("beyond", { vertices: [9] });
    const undone = session.undo();
    first.open();
    await expect(undone).rejects.toMatchObject({ reason: "HANDLE_VERTEX_OUT_OF_RANGE" });
    expect(session.newestInput).toBe(1);
  });

  test("waits for another one", async () => {
    const { server, session } = await begin();
    server.on.undo = ({ inputSeq }) => ({ result: { inputSeq } });
    expect(await Promise.all([session.undo(), session.undo(), session.redo()])).toEqual([1, 2, 3]);
    expect(server.undos.map(({ redo }) => redo)).toEqual([false, false, true]);
  });

  test("ends with what the server says, and the session goes on", async () => {
    const { server, session } = await begin();
    server.on.undo = () => {
      throw refusal("NOTHING_TO_UNDO", {}, Code.FailedPrecondition);
    };
    await expect(session.undo()).rejects.toMatchObject({ code: "failed_precondition", reason: "NOTHING_TO_UNDO" });
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    expect(server.updates[0]!.update!.inputSeq).toBe(2n); // the number of the step was used
  });

  test("of a reader, of a closed session, or with an abort is refused here", async () => {
    const { server, session } = await begin();
    server.on.undo = () => {
      throw new ConnectError("away", Code.Unavailable);
    };
    const abort = new AbortController();
    const undone = session.undo({ signal: abort.signal });
    await server.until(() => server.undos.length === 2);
    abort.abort();
    await expect(undone).rejects.toMatchObject({ code: "cancelled" });
    await session.close();
    await expect(session.undo()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
    const reader = await joinWith(server.rpc(), "sessions/1", {});
    opened.push(reader);
    await expect(reader.redo()).rejects.toMatchObject({ reason: "NOT_THE_WRITER" });
  });

  test("gives up once the time of calls is over", async () => {
    const { server, session } = await begin();
    const brief = await joinWith(server.rpc(300), session.name, { role: "writer" });
    opened.push(brief);
    server.on.undo = () => {
      throw new ConnectError("away", Code.Unavailable);
    };
    await expect(brief.undo()).rejects.toMatchObject({ code: "deadline_exceeded" });
  });
});

test("a step that is to be one of its own is, and is not sent beside another", async () => {
  const { server, session } = await begin();
  const answer = gate();
  server.on.update = (_, count) => (count === 1 ? answer.isOpen : undefined);
  session.update({ handles: { tip: { move: at(1) } }, beginsStep: true });
  session.move("tip", at(2));
  await server.until(() => server.updates.length === 1);
  await new Promise((resolve) => setTimeout(resolve, 20));
  expect(server.updates.length).toBe(1);
  answer.open();
  await server.until(() => server.updates.length === 2);
  expect(server.updates.map(({ update }) => update!.beginsStep)).toEqual([true, false]);
});

const everyHold: { [K in Hold["kind"]]: Extract<Hold, { kind: K }> } = {
  exact: { kind: "exact" },
  soft: { kind: "soft", weight: 3 },
  orientation: { kind: "orientation" },
  axisLock: { kind: "axisLock", axis: [1, 0, 0] },
  planeLock: { kind: "planeLock", normal: [0, 1, 0] },
};

test("changes of every kind come back from the wire as they went out", () => {
  const handles: Record<string, HandleChange> = {
    moved: { move: { axis: [0, 0, 2], angle: 0.5, center: [1, 2, 3], translation: [4, 5, 6] } },
    freed: { move: "fixed" },
    gone: { remove: true },
    ...Object.fromEntries(
      Object.values(everyHold).map((hold) => [
        hold.kind,
        { set: { vertices: new Uint32Array([2, 1]), motion: "fixed" as const, hold, footprint: 0.25 } },
      ]),
    ),
    placed: {
      set: {
        vertices: new Uint32Array([0]),
        motion: { targets: new Float64Array([0.1, 0.2, 0.3]) },
        hold: { kind: "exact" },
        footprint: 0,
      },
    },
    rounded: { move: { targets: new Float32Array([1, 2, 3]) } },
    pinned: {
      set: {
        points: [{ face: 7, barycentric: [0.2, 0.3, 0.5] }],
        motion: "fixed",
        hold: { kind: "soft", weight: 1 },
        footprint: 0,
      },
    },
  };
  const { handles: changes } = updateToWire({ handles }, 1, new Packer());
  expect({ ...changesFromWire(create(UndoUpdateResponseSchema, { changes }).changes).handles }).toEqual(handles);
});

describe("a snapshot", () => {
  const part = (offset: number, data: number[], sizeBytes = 5n) => ({
    offset: BigInt(offset),
    sizeBytes,
    data: new Uint8Array(data),
  });

  test("is put together of its parts", async () => {
    const { server, session } = await begin();
    server.on.snapshot = async function* () {
      yield part(0, [1, 2, 3]);
      yield part(3, [4, 5]);
    };
    expect([...(await session.snapshot())]).toEqual([1, 2, 3, 4, 5]);
  });

  test.each([
    ["without its end", [part(0, [1, 2, 3])]],
    ["without a part in between", [part(0, [1]), part(3, [4, 5])]],
    ["with more than it has", [part(0, [1, 2, 3]), part(3, [4, 5, 6])]],
    ["of nothing", []],
  ])("%s is refused", async (_, parts) => {
    const { server, session } = await begin();
    server.on.snapshot = async function* () {
      yield* parts;
    };
    await expect(session.snapshot()).rejects.toMatchObject({ code: "data_loss", reason: "SNAPSHOT_INCOMPLETE" });
  });

  test("of a session that there is not says so, and of a closed one", async () => {
    const { server, session } = await begin();
    server.on.snapshot = async function* () {
      throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
    };
    await expect(session.snapshot()).rejects.toMatchObject({ code: "not_found", reason: "SESSION_UNKNOWN" });
    await session.close();
    await expect(session.snapshot()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
  });

  test("makes a session, again where the server loses that, with what came after", async () => {
    const server = new FakeServer();
    const session = await restoreWith(server.rpc(), new Uint8Array([1, 2, 3]), {});
    opened.push(session);
    expect(session.name).toBe("sessions/restored1");
    session.move("tip", at(4));
    await server.until(() => server.updates.length === 1);
    server.on.stream = (stream) => stream.open(0, { inputSeq: 1n });
    session.poll();
    await server.until(() => server.streams.length === 1);
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await server.until(() => server.updates.length === 2);
    expect(server.restored.map(({ snapshot }) => snapshot?.source.value)).toEqual(
      Array(2).fill(new Uint8Array([1, 2, 3])),
    );
    expect(server.restored[1]!.requestId).not.toBe(server.restored[0]!.requestId);
    expect(server.updates[1]!).toMatchObject({ session: "sessions/restored2", update: { handles: [{ name: "tip" }] } });
    await session.close();
    expect(server.deleted).toEqual(["sessions/restored2"]);
  });
});
