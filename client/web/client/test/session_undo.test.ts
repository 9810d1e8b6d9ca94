import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test } from "vitest";
import { GoAwayReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { joinWith, openWith } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";
import { at, begin, gate, opened, refusal } from "./harness.js";

const moved = (x: number) => ({
  name: "tip",
  change: {
    case: "move" as const,
    value: { kind: { case: "rigid" as const, value: { translation: { x, y: 0, z: 0 } } } },
  },
});

/** The session, which is made anew on another stream. */
async function lose(server: FakeServer): Promise<void> {
  server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
  server.stream.queue.finish();
  await server.until(() => server.streams.length === 2);
  server.stream.open();
}

describe("a step that is taken back", () => {
  test("comes after all updates before it, has a number, and counts in a session made anew", async () => {
    const { server, session } = await begin();
    const answer = gate();
    server.on.update = (_, count) => (count === 1 ? answer.isOpen : undefined);
    server.on.undo = () => ({ result: { inputSeq: 3n }, changes: [moved(7)] });
    session.setHandle("tip", { vertices: [1] });
    session.move("tip", at(1));
    const undone = session.undo();
    await server.until(() => server.updates.length === 1);
    expect(server.undos).toEqual([]);
    answer.open();
    expect(await undone).toBe(3);
    expect(server.updates.map(({ update }) => update!.inputSeq)).toEqual([1n, 2n]);
    expect(server.undos[0]).toMatchObject({ inputSeq: 3n, redo: false, writerToken: "token" });
    expect(session.newestInput).toBe(3);

    await lose(server);
    await server.until(() => server.updates.length === 3);
    const { inputSeq, handles } = server.updates[2]!.update!;
    expect([inputSeq, handles.length]).toEqual([3n, 1]);
    expect(handles[0]!.change).toMatchObject({
      case: "set",
      value: { motion: { kind: { case: "rigid", value: { translation: { x: 7, y: 0, z: 0 } } } } },
    });
  });

  test("may bring every kind of handle back", async () => {
    const { server, session } = await begin();
    const indices = { source: { case: "inline" as const, value: new Uint8Array(new Uint32Array([1]).buffer) } };
    const numbers = (...values: number[]) => ({
      source: { case: "inline" as const, value: new Uint8Array(new Float64Array(values).buffer) },
    });
    const axis = { x: 0, y: 1, z: 0 };
    const set = (name: string, value: object) => ({ name, change: { case: "set" as const, value } });
    server.on.undo = () => ({
      result: { inputSeq: 1n },
      changes: [
        set("soft", { vertices: indices, hold: { case: "soft", value: { weight: 0.5 } }, footprintRadius: 2 }),
        set("turned", { vertices: indices, hold: { case: "orientation", value: { weight: 50 } } }),
        set("axis", { vertices: indices, hold: { case: "axisLock", value: { axis } } }),
        set("plane", { vertices: indices, hold: { case: "planeLock", value: { normal: axis } } }),
        set("points", { points: { faces: indices, scalar: 2, barycentric: numbers(0.5, 0.25, 0.25) } }),
        set("__proto__", {
          vertices: indices,
          motion: { kind: { case: "targets", value: { scalar: 2, positions: numbers(1, 2, 3) } } },
        }),
        { name: "gone", change: { case: "remove" as const, value: {} } },
      ],
    });
    await session.undo();
    await lose(server);
    await server.until(() => server.updates.length === 1);
    const handles = Object.fromEntries(
      server.updates[0]!.update!.handles.map(({ name, change }) => [
        name === "__proto__" ? "targets" : name,
        change.value,
      ]),
    );
    expect(handles).toMatchObject({
      soft: { hold: { case: "soft", value: { weight: 0.5 } }, footprintRadius: 2 },
      turned: { hold: { case: "orientation", value: { weight: 50 } } },
      axis: { hold: { case: "axisLock", value: { axis } } },
      plane: { hold: { case: "planeLock", value: { normal: axis } } },
      points: { points: { faces: indices } },
      targets: { motion: { kind: { case: "targets" } } },
    });
    expect(Object.keys(handles)).not.toContain("gone");
  });

  test("is asked for again where the server is away", async () => {
    const { server, session } = await begin();
    server.on.undo = (_, count) => {
      if (count < 3) throw new ConnectError("away", Code.Unavailable);
      return { result: { inputSeq: 1n } };
    };
    await session.undo();
    expect(server.undos.map(({ inputSeq }) => inputSeq)).toEqual([1n, 1n, 1n]);
  });

  test("that cannot be leaves the session as it was", async () => {
    const { server, session } = await begin();
    server.on.undo = () => {
      throw refusal("NOTHING_TO_UNDO", {}, Code.FailedPrecondition);
    };
    await expect(session.undo()).rejects.toMatchObject({ reason: "NOTHING_TO_UNDO" });
    expect(session.newestInput).toBe(0);
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
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

  test("is not for readers, nor for a session that is closed", async () => {
    const server = new FakeServer();
    const reader = await joinWith(server.rpc(), "sessions/1", {});
    opened.push(reader);
    await expect(reader.undo()).rejects.toMatchObject({ reason: "NOT_THE_WRITER" });
    const { session } = await begin();
    await session.close();
    await expect(session.undo()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
  });

  test("begins where it is said to, also where updates are merged", async () => {
    const { server, session } = await begin();
    const answer = gate();
    server.on.update = (_, count) => (count === 1 ? answer.isOpen : undefined);
    session.setHandle("tip", { vertices: [1] });
    session.update({ handles: { tip: { move: at(1) } }, beginsStep: true });
    session.move("tip", at(2));
    answer.open();
    await server.until(() => server.updates.length === 2);
    expect(server.updates.map(({ update }) => update!.beginsStep)).toEqual([false, true]);
  });
});
