import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { crc32c } from "../src/crc32c.js";
import { meshIn } from "../src/snapshot_mesh.js";
import { root } from "./support/service.js";

const recorded = JSON.parse(readFileSync(join(root, "tests/golden/frames.json"), "utf8")) as {
  snapshot: { file: string };
};
const file = new Uint8Array(Buffer.from(recorded.snapshot.file, "base64"));

/** The file with a change of its content, whose header fits the content again. */
async function altered(content: Uint8Array): Promise<Uint8Array> {
  const made = new Uint8Array(24 + content.length);
  made.set(file.subarray(0, 24));
  made.set(content, 24);
  const header = new DataView(made.buffer);
  header.setUint32(12, await crc32c(content), true);
  header.setBigUint64(16, BigInt(content.length), true);
  return made;
}

test("a mesh is read from a recorded snapshot, wherever that lies in memory", async () => {
  const shifted = new Uint8Array(file.length + 3);
  shifted.set(file, 3);
  const { vertices, faces } = await meshIn(shifted.subarray(3));
  expect([vertices.length, faces.length]).toEqual([66, 60]);
  expect([...vertices.subarray(63)]).toEqual([10, 1, 0]);
});

test("a snapshot that is cut off, changed, of a later format or without a mesh is refused", async () => {
  const later = file.slice();
  later[8] = 2;
  await expect(meshIn(later)).rejects.toMatchObject({ reason: "SNAPSHOT_NEWER", limit: "format <= 1" });
  const changed = file.slice();
  changed[100]! ^= 1;
  const wrong = [file.subarray(0, 10), file.subarray(0, 100), changed, await altered(new Uint8Array(0))];
  for (let end = 1; end < 60; end += 7) wrong.push(await altered(file.subarray(24, 24 + end)));
  wrong.push(await altered(new Uint8Array([0x0a, 0x04, 0x0a, 0x02, 0x12, 0x00])));
  for (const one of wrong)
    await expect(meshIn(one)).rejects.toMatchObject({ code: "invalid_argument", reason: "SNAPSHOT_DAMAGED" });
});
