import { generateKeyPairSync, type KeyObject, sign } from "node:crypto";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { joinSession, type LpdeformError, openSession } from "../../src/index.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

const work = mkdtempSync(join(tmpdir(), "lpdeform-tokens-"));
let service: Service;
let key: KeyObject;

beforeAll(async () => {
  const { privateKey, publicKey } = generateKeyPairSync("ec", { namedCurve: "P-256" });
  key = privateKey;
  const file = join(work, "keys.pem");
  writeFileSync(file, publicKey.export({ type: "spki", format: "pem" }));
  service = await Service.start({ serverFlags: ["--token-keys", file] });
});
afterAll(async () => {
  await service.stop();
  rmSync(work, { recursive: true });
});

/** For how much longer than they say servers take tokens, in seconds. */
const leeway = 30;
/** As whoever signs users in makes it (JWT, ES256), taken for so many seconds. */
function tokenOf(sub: string, seconds = 60): string {
  const part = (value: object) => Buffer.from(JSON.stringify(value)).toString("base64url");
  const body = `${part({ alg: "ES256", typ: "JWT" })}.${part({ sub, exp: Math.floor(Date.now() / 1000) + seconds - leeway })}`;
  return `${body}.${sign("sha256", Buffer.from(body), { key, dsaEncoding: "ieee-p1363" }).toString("base64url")}`;
}

const { mesh, handles } = grid(10);

test("lets in with each call, solves, snapshots and streams too, and keeps callers apart", async () => {
  const ada = { url: service.url, token: () => tokenOf("ada") };
  const session = await openSession(mesh, ada);
  session.setHandles(handles);
  session.move("right", { translation: [0, 0, 2] });
  expect((await session.settle({ timeoutMs: 20_000 })).positions[3 * 9 + 2]).toBeCloseTo(2, 5);
  expect((await session.solve({ deadlineMs: 20_000 })).inputSeq).toBe(2);
  expect((await session.snapshot()).length).toBeGreaterThan(0);
  await (await joinSession(session.name, ada)).close();
  const bob = { url: service.url, token: () => Promise.resolve(tokenOf("bob")) };
  await expect(joinSession(session.name, bob)).rejects.toMatchObject({ code: "not_found", reason: "SESSION_UNKNOWN" });
  await session.close();
});

test("that is missing or wrong is said by name", async () => {
  const { url } = service;
  await expect(openSession(mesh, { url })).rejects.toMatchObject({ code: "unauthenticated", reason: "TOKEN_MISSING" });
  for (const text of ["nonsense", `${tokenOf("ada").slice(0, -4)}AAAA`]) {
    await expect(openSession(mesh, { url, token: () => text })).rejects.toMatchObject({
      code: "unauthenticated",
      reason: "TOKEN_INVALID",
    });
  }
  await expect(openSession(mesh, { url, token: () => tokenOf("ada", -60) })).rejects.toMatchObject({
    code: "unauthenticated",
    reason: "TOKEN_EXPIRED",
  });
});

test("is renewed by the function when it has expired: the stream is opened again, and the drag goes on", async () => {
  let given = 0;
  const session = await openSession(mesh, { url: service.url, token: () => (++given, tokenOf("ada", 3)) });
  session.setHandles(handles);
  await session.settle({ timeoutMs: 20_000 });
  const expired = new Promise<LpdeformError>((resolve) => {
    session.on("connection", () => session.interruption && resolve(session.interruption));
  });
  expect(await expired).toMatchObject({ code: "unauthenticated", reason: "TOKEN_EXPIRED" });
  const before = given;
  session.move("right", { translation: [0, 0, 3] });
  expect((await session.settle({ timeoutMs: 20_000 })).positions[3 * 9 + 2]).toBeCloseTo(3, 5);
  expect(given).toBeGreaterThan(before);
  await session.close();
}, 60_000);

test.each([
  ["fails", () => Promise.reject(new Error("not signed in")), "The function of the token failed: Error: not signed in"],
  [
    "throws",
    () => {
      throw new Error("not signed in");
    },
    "The function of the token failed: Error: not signed in",
  ],
  ["gives a line break", () => "abc\n", "The function of the token gave something that a header cannot carry."],
  [
    "gives no text",
    () => undefined as unknown as string,
    "The function of the token gave something that a header cannot carry.",
  ],
])("whose function %s ends the call", async (_, token, message) => {
  await expect(openSession(mesh, { url: service.url, token })).rejects.toMatchObject({
    code: "unauthenticated",
    reason: "TOKEN_FUNCTION",
    message,
  });
});

test("whose function fails ends a session that lives, with what it failed with", async () => {
  let isSignedIn = true;
  const token = () => {
    if (!isSignedIn) throw new Error("signed out");
    return tokenOf("ada", 3);
  };
  const session = await openSession(mesh, { url: service.url, token });
  session.setHandles(handles);
  await session.settle({ timeoutMs: 20_000 });
  isSignedIn = false;
  const ended = (async () => {
    for await (const _ of session);
  })();
  await expect(ended).rejects.toMatchObject({ code: "unauthenticated", reason: "TOKEN_FUNCTION" });
  expect(session.connection).toBe("closed");
}, 60_000);
