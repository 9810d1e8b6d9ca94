import { Code, ConnectError } from "@connectrpc/connect";
import { expect, test } from "vitest";
import { crc32c } from "../src/crc32c.js";
import { fromCall, LpdeformError } from "../src/errors.js";
import { joinSession, openSession } from "../src/index.js";
import { Backoff } from "../src/recovery.js";
import { triangle } from "./fake_server.js";

test("a network that fails is a server that is away", () => {
  const error = fromCall(new TypeError("fetch failed"));
  expect(error).toMatchObject({ code: "unavailable", reason: "", message: "The server cannot be reached." });
  expect(fromCall(ConnectError.from(new TypeError("Failed to fetch"))).code).toBe("unavailable");
});

test("codes keep their names, and errors of ours stay as they are", () => {
  expect(fromCall(new ConnectError("x", Code.ResourceExhausted))).toMatchObject({
    code: "resource_exhausted",
    message: "x",
  });
  const error = new LpdeformError("aborted", "y");
  expect(fromCall(error)).toBe(error);
  expect(fromCall("anything else").code).toBe("unknown");
});

test("nobody listening is said at once", async () => {
  const url = "http://127.0.0.1:9";
  await expect(openSession(triangle, { url })).rejects.toMatchObject({ code: "unavailable" });
  await expect(joinSession("sessions/1", { url })).rejects.toMatchObject({ code: "unavailable" });
});

test("outside of a page the proxy has to be named", async () => {
  await expect(openSession(triangle)).rejects.toThrow(/url/);
});

test("what is no gRPC-Web is an error and not a hang", async () => {
  const fetch = async () => new Response("<html>", { status: 502, headers: { "content-type": "text/html" } });
  await expect(openSession(triangle, { url: "http://a.example", fetch })).rejects.toMatchObject({
    code: "unavailable",
  });
});

test("the checksum is CRC-32C, of any number of bytes", async () => {
  expect(await crc32c(new TextEncoder().encode("123456789"))).toBe(0xe3069283);
  expect(await crc32c(new Uint8Array(0))).toBe(0);
  expect(await crc32c(new Uint8Array(32))).toBe(0x8a9136aa); // RFC 3720, B.4
  // In several steps, and beginning anywhere in memory, as bit by bit.
  const bytes = Uint8Array.from({ length: 1_100_003 }, (_, k) => (k * k) >> 5).subarray(3);
  let rest = 0xffffffff;
  for (const byte of bytes) {
    rest ^= byte;
    for (let bit = 0; bit < 8; ++bit) rest = rest & 1 ? (rest >>> 1) ^ 0x82f63b78 : rest >>> 1;
  }
  expect(await crc32c(bytes)).toBe(~rest >>> 0);
});

test("pauses grow to two seconds and are spread", () => {
  const backoff = new Backoff();
  const pauses = Array.from({ length: 12 }, () => backoff.nextMs());
  pauses.forEach((pause, k) => {
    const longest = Math.min(50 * 2 ** k, 2000);
    expect(pause).toBeGreaterThanOrEqual(longest / 2);
    expect(pause).toBeLessThanOrEqual(longest);
  });
  backoff.reset();
  expect(backoff.nextMs()).toBeLessThanOrEqual(50);
});
