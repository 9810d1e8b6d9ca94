import { Code, ConnectError } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { GoAwayReason } from "../src/gen/lpdeform/v1/service_pb.js";
import { begin, next, refusal } from "./harness.js";

const base = { base: { vertices: [0] } };

/** A session whose update 1 was answered with a final frame, which was taken. */
async function settled() {
  const begun = await begin();
  begun.session.setHandles(base);
  await begun.server.until(() => begun.server.updates.length === 1);
  begun.server.stream.frame({ frameSeq: 1n, inputSeq: 1n, isFinal: true }, { x: 1 });
  return { ...begun, frame: await next(begun.session) };
}

test("a result that was taken is returned at once, as often as it is asked for", async () => {
  const { session, frame } = await settled();
  for (let k = 0; k < 3; ++k) expect(await session.settle({ timeoutMs: 0 })).toBe(frame);
});

test("a result that was taken is returned while the connection is down", async () => {
  const { server, session, frame } = await settled();
  server.stream.queue.finish(new ConnectError("gone", Code.Unavailable));
  await server.until(() => server.streams.length === 2);
  expect(await session.settle({ timeoutMs: 0 })).toBe(frame);
});

test("an update that is under way asks for another result", async () => {
  const { server, session } = await settled();
  session.setHandles({ tip: { vertices: [1] } });
  await expect(session.settle({ timeoutMs: 0 })).rejects.toMatchObject({ reason: "NO_FRAME" });
  server.stream.frame({ frameSeq: 2n, inputSeq: 2n, isFinal: true }, { x: 2 });
  expect((await session.settle()).inputSeq).toBe(2);
});

test("what was refused leaves the result before it", async () => {
  const { server, session, frame } = await settled();
  server.on.update = () => {
    throw refusal("HANDLE_VERTEX_OUT_OF_RANGE", {});
  };
  session.setHandles({ tip: { vertices: [9] } });
  await expect(session.settle()).rejects.toMatchObject({ reason: "HANDLE_VERTEX_OUT_OF_RANGE" });
  expect(await session.settle({ timeoutMs: 0 })).toBe(frame);
});

test.each([
  ["the newest result is returned, though the session has ended since", false],
  ["the end of the session is reported if it dropped the newest update", true],
])("%s", async (_, isUnderWay) => {
  const { server, session } = await begin();
  session.setHandles(base);
  await server.until(() => server.updates.length === 1);
  server.stream.frame({ frameSeq: 1n, inputSeq: 1n, isFinal: true }, { x: 1 });
  server.on.update = () => new Promise<never>(() => undefined); // without an answer
  if (isUnderWay) session.setHandles({ tip: { vertices: [1] } });
  server.stream.goAway(GoAwayReason.SESSION_DELETED);
  const closed = new Promise<void>((resolve) => session.on("connection", (state) => state === "closed" && resolve()));
  await closed;
  if (isUnderWay) await expect(session.settle()).rejects.toMatchObject({ reason: "SESSION_DELETED" });
  else expect((await session.settle()).inputSeq).toBe(1);
});

test("everybody who waits gets the result", async () => {
  const { server, session } = await begin();
  session.setHandles(base);
  const all = [session.settle(), session.settle(), session.settle()];
  await server.until(() => server.updates.length === 1);
  server.stream.frame({ frameSeq: 1n, inputSeq: 1n, isFinal: true }, { x: 1 });
  const frames = await Promise.all(all);
  expect(frames.map(({ inputSeq }) => inputSeq)).toEqual([1, 1, 1]);
});

test("whoever has taken over waits for a new frame", async () => {
  const { session } = await settled();
  await session.takeOver();
  await expect(session.settle({ timeoutMs: 0 })).rejects.toMatchObject({ reason: "NO_FRAME" });
});

test("of a closed session there is none", async () => {
  const { session } = await settled();
  await session.close();
  await expect(session.settle()).rejects.toMatchObject({ reason: "SESSION_CLOSED" });
});
