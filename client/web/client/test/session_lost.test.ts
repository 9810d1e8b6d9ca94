import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test } from "vitest";
import { GoAwayReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { joinWith } from "../src/session.js";
import { FakeServer } from "./fake_server.js";
import { at, begin, next, opened, refusal } from "./harness.js";

describe("a session that the server has lost", () => {
  test("is recreated from mesh, handles and settings as they were accepted", async () => {
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
    expect(update!.handles[1]!.change.value).toMatchObject({
      motion: { kind: { case: "rigid", value: { translation: { x: 3 } } } },
    });
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

  test("is recreated once, however many updates and streams find out, and however late", async () => {
    const { server, session } = await begin();
    session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    await server.until(() => server.updates.length === 1);
    let answer = () => {};
    const isAnswered = new Promise<void>((resolve) => (answer = resolve));
    server.on.update = async ({ session: name }) => {
      if (name !== "sessions/1") return;
      await isAnswered;
      throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
    };
    server.on.stream = (stream) => stream.open();
    session.move("tip", at(1));
    session.move("tip", at(2));
    await server.until(() => server.updates.length > 1);
    // The stream finds out first, and has another session by the time that the update is answered.
    server.stream.goAway(GoAwayReason.SESSION_EXPIRED);
    server.stream.queue.finish();
    await server.until(() => server.streams.length === 2);
    answer();
    await server.until(
      () => server.updates.at(-1)!.update!.inputSeq >= 3n && server.updates.at(-1)!.session !== "sessions/1",
    );
    session.move("tip", at(3));
    await server.until(() => server.updates.at(-1)!.update!.inputSeq === 4n);
    expect([server.creations.length, session.name]).toEqual([2, "sessions/2"]);

    // And the other way round: an update finds out first, the stream long after.
    server.on.update = ({ session: name }) => {
      if (name === "sessions/2") throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
    };
    const stream = server.stream;
    session.move("tip", at(4));
    await server.until(() => server.updates.at(-1)!.session === "sessions/3");
    stream.goAway(GoAwayReason.SESSION_EXPIRED);
    stream.queue.finish();
    await server.until(() => server.streams.length === 3);
    expect(server.stream.request.streams.map(({ session: name }) => name)).toEqual(["sessions/3"]);
    expect([server.creations.length, session.name]).toEqual([3, "sessions/3"]);
  });

  test("by expiring is recreated", async () => {
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

  test("is asked for again no sooner than a full server says", async () => {
    const full = refusal("SESSIONS_FULL", {}, Code.ResourceExhausted, 900);
    for (const isFoundByUpdate of [false, true]) {
      const { server, session } = await begin();
      const asked: number[] = [];
      server.on.create = (_, count) => {
        asked.push(performance.now());
        if (count === 2) throw full;
      };
      server.on.update = ({ session: name }) => {
        if (name === "sessions/1") throw refusal("SESSION_UNKNOWN", {}, Code.NotFound);
      };
      server.on.stream = (stream) => {
        if (stream.request.streams[0]!.session !== "sessions/1") return stream.open();
        stream.goAway(GoAwayReason.SESSION_EXPIRED);
        stream.queue.finish();
      };
      if (isFoundByUpdate) session.setHandle("tip", { vertices: [1] });
      else server.stream.queue.finish(new ConnectError("broken", Code.Unavailable));
      await server.until(() => server.creations.length === 3);
      expect(asked[1]! - asked[0]!).toBeGreaterThan(890);
    }
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
