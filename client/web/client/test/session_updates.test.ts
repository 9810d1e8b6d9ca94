import { Code, ConnectError } from "@connectrpc/connect";
import { describe, expect, test } from "vitest";
import { joinWith, openWith } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";
import { at, begin, gate, opened, problems, refusal } from "./harness.js";

describe("updates", () => {
  test("say how far to look for lower minima, or leave it to the server", async () => {
    const { server, session } = await begin();
    session.set({ solver: { search: { effort: 3, show: true, leastShare: 0.1 } } });
    await server.until(() => server.updates.length === 1);
    session.set({ solver: { search: {} } });
    await server.until(() => server.updates.length === 2);
    session.set({ solver: {} });
    await server.until(() => server.updates.length === 3);
    expect(server.updates.map(({ update }) => update!.settings!.solver!.search)).toMatchObject([
      { effort: 3, show: true, leastShare: 0.1 },
      { show: false, leastShare: 0 },
      undefined,
    ]);
  });

  test("leave the effort of a search to the server unless it is given", async () => {
    const { server, session } = await begin();
    session.set({ solver: { search: { show: true } } });
    await server.until(() => server.updates.length === 1);
    session.set({ solver: { search: { effort: 0 } } });
    await server.until(() => server.updates.length === 2);
    const [shown, none] = server.updates.map(({ update }) => update!.settings!.solver!.search!);
    expect([shown!.show, shown!.effort, none!.effort]).toEqual([true, undefined, 0]);
  });

  test.each([3, 30_000])("come before a snapshot that is taken after them, with %d vertices", async (count) => {
    const server = new FakeServer();
    const mesh = { vertices: Float32Array.from({ length: 3 * count }, (_, k) => k), faces: [0, 1, 2] };
    const session = await openWith(server.rpc(), mesh, {});
    const order: string[] = [];
    server.on.update = ({ update }) => void order.push(`update ${update!.inputSeq}`);
    server.on.snapshot = async function* () {
      order.push("snapshot");
      yield { offset: 0n, sizeBytes: 1n, data: new Uint8Array(1) };
    };
    session.setHandle("tip", { vertices: [1] });
    session.move("tip", at(1));
    await session.snapshot();
    session.move("tip", at(2));
    await server.until(() => order.length === 4);
    expect(order).toEqual(["update 1", "update 2", "snapshot", "update 3"]);
    await session.close();
  });

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

  test.each([
    [[0, -1], "number 1"],
    [[1.5], "number 0"],
    [[0, 1, NaN], "number 2"],
    [[2 ** 32], "number 0"],
  ])("with %j in place of indices are refused before they are sent", async (vertices, element) => {
    const { server, session } = await begin();
    const problem = problems(session, 1);
    session.setHandles({ tip: { vertices } });
    expect((await problem)[0]).toMatchObject({ code: "invalid_argument", reason: "INDEX_OUT_OF_RANGE", element });
    expect(server.updates.length).toBe(0);
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

  test("are sent again until the server has them, also where an answer comes late of what was sent before", async () => {
    const { server, session } = await begin();
    session.setHandles({ base: { vertices: [0] }, tip: { vertices: [1] } });
    server.on.solve = async function* () {
      throw refusal("COMPONENT_WITHOUT_HANDLE", {}, Code.FailedPrecondition);
    };
    await session.solve().catch(() => undefined); // then all updates are answered
    const [late, lost] = [gate(), gate()];
    server.on.update = async (_, count) => {
      if (count === 2) throw new ConnectError("broken", Code.Unavailable);
      if (count === 3) await late.isOpen;
      if (count !== 4) return;
      await lost.isOpen;
      throw new ConnectError("broken", Code.Unavailable);
    };
    session.move("base", at(1));
    session.move("tip", at(2));
    await server.until(() => server.updates.length === 4);
    late.open();
    await Promise.resolve();
    lost.open();
    await server.until(() => server.updates.length === 5);
    expect(server.updates[4]!.update!.handles.map(({ name }) => name)).toEqual(["base", "tip"]);
  });

  test("that cannot be solved for yet are reported, but not where newer ones are there", async () => {
    const { server, session } = await begin();
    const first = gate();
    server.on.update = async (_, count) => {
      if (count === 1) await first.isOpen;
      if (count !== 2) throw refusal("NO_HANDLES", { element: `update ${count}` }, Code.FailedPrecondition);
    };
    const reported = problems(session, 1);
    session.set({ p: 2 });
    await server.until(() => server.updates.length === 1);
    session.set({ p: 3 });
    first.open();
    await server.until(() => server.updates.length === 2);
    const fault = { code: Code.FailedPrecondition, reason: "NO_HANDLES" };
    server.stream.send({ case: "fault", value: { ...fault, element: "overtaken", inputSeq: 1n } });
    server.stream.send({ case: "fault", value: { ...fault, element: "newest", inputSeq: 2n } });
    expect((await reported)[0]).toMatchObject({ element: "newest" });
    const last = problems(session, 1);
    session.set({ p: 4 });
    expect((await last)[0]).toMatchObject({ element: "update 3" });
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

describe("a part of an upload that the server has no room for yet", () => {
  const large = { vertices: new Float32Array(600_000), faces: new Uint32Array([0, 1, 2]) };

  test("is sent again after the pause that the server asks for", async () => {
    const server = new FakeServer();
    server.on.part = (_, count) => {
      if (count === 2 || count === 3) throw refusal("UPLOAD_RATE", {}, Code.ResourceExhausted, 200);
    };
    const start = performance.now();
    opened.push(await openWith(server.rpc(), large, {}));
    expect(performance.now() - start).toBeGreaterThan(390);
    expect(server.parts.map(({ offset }) => Number(offset) / 2 ** 20)).toEqual([
      0,
      ...[0.25, 0.25, 0.25],
      ...[0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25],
    ]);
  });

  test("is sent again for no longer than a call may take", async () => {
    const server = new FakeServer();
    server.on.part = () => {
      throw refusal("UPLOAD_RATE", {}, Code.ResourceExhausted, 900);
    };
    const failing = { code: "resource_exhausted", reason: "UPLOAD_RATE", retryAfterMs: 900 };
    await expect(openWith(server.rpc(500), large, {})).rejects.toMatchObject(failing);
    expect(server.parts.length).toBe(1);
  });

  test("is not sent again where the server says of no pause", async () => {
    const server = new FakeServer();
    server.on.part = () => {
      throw refusal("CALLER_MEMORY_FULL", {}, Code.ResourceExhausted);
    };
    await expect(openWith(server.rpc(), large, {})).rejects.toMatchObject({ reason: "CALLER_MEMORY_FULL" });
    expect(server.parts.length).toBe(1);
  });

  test("is waited for no more once the caller has enough of it", async () => {
    const server = new FakeServer();
    server.on.part = () => {
      throw refusal("UPLOAD_RATE", {}, Code.ResourceExhausted, 30_000);
    };
    const enough = new AbortController();
    const opening = openWith(server.rpc(60_000), large, { signal: enough.signal });
    const start = performance.now();
    await server.until(() => server.parts.length === 1);
    enough.abort();
    await expect(opening).rejects.toMatchObject({ code: "cancelled" });
    expect(performance.now() - start).toBeLessThan(15_000);
  });
});

describe("settling", () => {
  test("waits for the finished frame of the newest update", async () => {
    const { server, session } = await begin();
    session.setHandle("tip", { vertices: [1] });
    const settled = session.settle();
    server.stream.frame({ frameSeq: 1n, inputSeq: 0n, isFinal: true });
    await server.until(() => server.acks.length === 1);
    server.stream.frame({ frameSeq: 2n, inputSeq: 1n });
    await server.until(() => server.acks.length === 2);
    server.stream.frame({ frameSeq: 3n, inputSeq: 1n, isFinal: true });
    expect((await settled).frameSeq).toBe(3);
  });

  test("ends with a problem, a deadline, or an abort", async () => {
    const { server, session } = await begin();
    const fault = {
      code: Code.FailedPrecondition,
      reason: "COMPONENT_WITHOUT_HANDLE",
      element: "component 1",
      inputSeq: 1n,
    };
    const settled = session.settle();
    server.stream.send({ case: "fault", value: fault });
    await expect(settled).rejects.toMatchObject({
      reason: "COMPONENT_WITHOUT_HANDLE",
      element: "component 1",
      inputSeq: 1,
    });
    await expect(session.settle({ timeoutMs: 20 })).rejects.toMatchObject({
      code: "deadline_exceeded",
      reason: "NO_FRAME",
    });
    await expect(session.settle({ signal: AbortSignal.abort() })).rejects.toMatchObject({ code: "cancelled" });
  });
});

describe("opening", () => {
  test("says what is wrong with the mesh", async () => {
    const server = new FakeServer();
    const halves = { vertices: [0, 0, 0, 1], faces: [0, 0, 0] };
    await expect(openWith(server.rpc(), halves, {})).rejects.toMatchObject({
      reason: "MESH_SIZE",
      element: "vertices",
    });
    await expect(openWith(server.rpc(), { ...triangle, faces: [0, 1] }, {})).rejects.toMatchObject({
      element: "faces",
    });
    server.on.create = () => {
      throw refusal("MESH_NOT_FINITE", { element: "vertex 1" });
    };
    await expect(openWith(server.rpc(), triangle, {})).rejects.toMatchObject({
      reason: "MESH_NOT_FINITE",
      element: "vertex 1",
    });
  });
});
