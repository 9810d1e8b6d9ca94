import { describe, expect, test, vi } from "vitest";
import { Encoding } from "../src/gen/lpdeform/v1/frame_pb.js";
import { NoticeReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { openWith } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";
import { arrived, at, begin, connected, next, opened } from "./harness.js";

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

  test("come with what the server says about itself, for as long as its stream lasts", async () => {
    const { server, session } = await begin();
    const heard: unknown[] = [];
    session.on("notice", (notice) => heard.push(notice));
    server.stream.send({ case: "notice", value: { reason: NoticeReason.OVERLOADED, text: "Too much." } });
    server.stream.send({ case: "notice", value: { reason: NoticeReason.RECOVERED, text: "No more." } });
    server.stream.send({ case: "notice", value: { reason: 9 as NoticeReason, text: "Something new." } });
    server.stream.frame({ frameSeq: 1n });
    await arrived(server, session);
    const said = [
      { reason: "overloaded", text: "Too much." },
      { reason: "recovered", text: "No more." },
      { reason: "other", text: "Something new." },
    ];
    expect(heard).toEqual(said);
    expect(session.notice).toEqual(said[2]);
    server.stream.queue.finish();
    await server.until(() => server.streams.length === 2);
    expect(session.notice).toBeUndefined();
    expect(heard).toEqual([...said, undefined]);
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
    const session = await openWith(server.rpc(), triangle, {
      credit: 5,
      encoding: "quantized",
      withNormals: true,
      certify: true,
      maxFramesPerSecond: 24,
    });
    opened.push(session);
    session.poll();
    await server.until(() => server.streams.length > 0);
    expect(server.stream.request.streams[0]!.options).toMatchObject({
      credit: 5,
      encoding: Encoding.QUANTIZED,
      lowestEncoding: Encoding.QUANTIZED,
      withNormals: true,
      certify: true,
      maxFramesPerSecond: 24,
    });
  });

  test("come again with their certificate", async () => {
    const { server, session } = await begin();
    server.stream.frame({ frameSeq: 1n, inputSeq: 0n, isFinal: true });
    const result = await next(session);
    server.stream.frame({ frameSeq: 2n, inputSeq: 0n, isFinal: true, certificate: { relativeGap: 0.25 } });
    const certified = await next(session);
    expect([result.optimalityGap, certified.optimalityGap]).toEqual([undefined, 0.25]);
    expect(certified.inputSeq).toBe(result.inputSeq);
    await server.until(() => server.acks.some(({ frameSeq }) => frameSeq === 2n));
  });

  test("are asked for without a certificate where none is wanted", async () => {
    const { server } = await begin();
    expect(server.stream.request.streams[0]!.options!.certify).toBe(false);
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

  test("of a session that comes later reopen the stream, and old credit is not given to it", async () => {
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
    await other.close();
    await server.until(() => server.streams.length === 3);
    expect(server.stream.request.streams.map(({ session: name }) => name)).toEqual([session.name]);
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

  /** Time enough for whatever a hidden page does. */
  const wait = () => vi.advanceTimersByTime(60_000);

  test("gives its connection back until it is seen again", async () => {
    const { server, session } = await beginOnPage();
    server.stream.frame({ frameSeq: 1n, isFinal: true });
    await arrived(server, session);
    show(true);
    wait();
    await server.until(() => server.stream.isAborted);
    expect(session.connection).toBe("idle");
    expect(server.streams.length).toBe(1);
    show(false);
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    await connected(session);
  });

  test("does so in the middle of a solve as well, whose result comes when it is seen", async () => {
    const { server, session } = await beginOnPage();
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    server.stream.frame({ frameSeq: 1n, inputSeq: 1n }); // which a page that does not draw does not take
    await arrived(server, session);
    show(true);
    wait();
    await server.until(() => server.stream.isAborted);
    expect([session.connection, server.acks]).toEqual(["idle", []]);
    show(false);
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    server.stream.frame({ frameSeq: 1n, inputSeq: 1n, isFinal: true });
    await connected(session);
    await arrived(server, session);
    expect(await next(session)).toMatchObject({ inputSeq: 1, isFinal: true });
  });

  test("keeps it while an update is to be sent, and takes it again for one", async () => {
    const { server, session } = await beginOnPage();
    let answer = () => {};
    const isAnswered = new Promise<void>((resolve) => (answer = resolve));
    server.on.update = () => isAnswered;
    session.setHandle("tip", { vertices: [1] });
    await server.until(() => server.updates.length === 1);
    show(true);
    wait();
    expect(session.connection).toBe("connected");
    answer();
    session.move("tip", at(2));
    await vi.waitFor(() => {
      wait();
      expect(session.connection).toBe("idle");
    });
    expect(server.updates.length).toBe(2);
    session.move("tip", at(1));
    await server.until(() => server.streams.length === 2);
    expect(page.hidden).toBe(true);
  });

  test("keeps it while somebody settles, and takes it again for that", async () => {
    const { server, session } = await beginOnPage();
    show(true);
    wait();
    expect(session.connection).toBe("idle");
    const settled = session.settle();
    await server.until(() => server.streams.length === 2);
    server.stream.open();
    await connected(session);
    wait();
    expect(session.connection).toBe("connected");
    server.stream.frame({ frameSeq: 1n, isFinal: true });
    expect((await settled).frameSeq).toBe(1);
    wait();
    expect(session.connection).toBe("idle");
  });
});
