import { Code, ConnectError } from "@connectrpc/connect";
import { afterEach, vi } from "vitest";
import type { LpdeformError } from "../src/index.js";
import { openWith, type Session } from "../src/session.js";
import { FakeServer, triangle } from "./fake_server.js";

// What tests of sessions share: a session on a server whose every word the test chooses.

/** Sessions to be closed after the test. */
export const opened: Session[] = [];

/** A session of a triangle, and the server that it is on; frames are asked for and the stream is open. */
export async function begin(server = new FakeServer(), rpc = server.rpc()) {
  const session = await openWith(rpc, triangle, {});
  opened.push(session);
  session.poll();
  await server.until(() => server.streams.length > 0);
  server.stream.open();
  await connected(session);
  return { server, session, rpc };
}

/** Resolves when all that was sent on the stream so far has come. */
export async function arrived(server: FakeServer, session: Session): Promise<void> {
  const mark = problems(session, 1);
  server.stream.send({ case: "fault", value: { reason: "MARK" } });
  await mark;
}

export function connected(session: Session): Promise<void> {
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
export function problems(session: Session, count: number): Promise<LpdeformError[]> {
  const all: LpdeformError[] = [];
  return new Promise((resolve) => session.on("problem", (error) => all.push(error) === count && resolve(all)));
}

export async function next(session: Session) {
  return (await session[Symbol.asyncIterator]().next()).value!;
}

/** Something to wait for until it is opened. */
export function gate(): { isOpen: Promise<void>; open: () => void } {
  let open = () => {};
  const isOpen = new Promise<void>((resolve) => (open = resolve));
  return { isOpen, open };
}

export const at = (x: number) => ({ translation: [x, 0, 0] as const });

afterEach(async () => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  await Promise.all(opened.splice(0).map((session) => session.close().catch(() => undefined)));
});

/** An error as the server makes it. */
export function refusal(
  reason: string,
  metadata: Record<string, string>,
  code = Code.InvalidArgument,
  retryMs = 0,
): ConnectError {
  const error = new ConnectError("No.", code);
  const field = (number: number, bytes: Uint8Array) => [8 * number + 2, bytes.length, ...bytes];
  const text = (value: string) => new TextEncoder().encode(value);
  const entries = Object.entries(metadata).flatMap(([key, value]) =>
    field(3, new Uint8Array([...field(1, text(key)), ...field(2, text(value))])),
  );
  const info = new Uint8Array([...field(1, text(reason)), ...entries]);
  error.details.push({ type: "google.rpc.ErrorInfo", value: info });
  const varint = (value: number): number[] =>
    value < 128 ? [value] : [(value % 128) | 128, ...varint(Math.floor(value / 128))];
  const [seconds, nanos] = [Math.floor(retryMs / 1000), (retryMs % 1000) * 1e6];
  const duration = new Uint8Array([8, ...varint(seconds), 16, ...varint(nanos)]);
  if (retryMs > 0) error.details.push({ type: "google.rpc.RetryInfo", value: new Uint8Array(field(1, duration)) });
  return error;
}
