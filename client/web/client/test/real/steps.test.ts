import { afterAll, beforeAll, expect, test } from "vitest";
import { type Frame, joinSession, openSession, restoreSession, type Session } from "../../src/index.js";
import { resultRecreated } from "../support/recreated.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

const lifted = (height: number) => ({ handles: { right: { move: { translation: [0, 0, height] } } } }) as const;
/** Of a vertex of the edge that is lifted. */
const heightOf = ({ positions }: Frame) => positions[3 * 19 + 2]!;
const settled = async (session: Session) => heightOf(await session.settle({ timeoutMs: 20_000 }));

/** A sheet, its right edge lifted to 2 and then, as a step of its own, to 5. */
async function lift(): Promise<Session> {
  const { mesh, handles } = grid(20);
  const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
  session.setHandles(handles);
  await session.settle({ timeoutMs: 20_000 });
  for (const height of [2, 5]) {
    session.update({ ...lifted(height), beginsStep: true });
    expect(await settled(session)).toBeCloseTo(height, 5);
  }
  return session;
}

test("undo and redo step through what a person did, and frames follow", async () => {
  const session = await lift();
  const seq = await session.undo();
  const back = await session.settle({ timeoutMs: 20_000 });
  expect(back.inputSeq).toBe(seq);
  expect(heightOf(back)).toBeCloseTo(2, 5);
  await session.undo();
  expect(await settled(session)).toBeCloseTo(0, 5);
  await session.redo();
  await session.redo();
  expect(await settled(session)).toBeCloseTo(5, 5);
  await expect(session.redo()).rejects.toMatchObject({ code: "failed_precondition", reason: "NOTHING_TO_REDO" });
  session.update(lifted(7)); // and the session goes on
  expect(await settled(session)).toBeCloseTo(7, 5);
  await session.close();
});

test("a step that was taken back stays so where the server loses the session", async () => {
  const session = await lift();
  await session.undo();
  expect(await settled(session)).toBeCloseTo(2, 5);
  const { name } = session;
  await service.killServer();
  await service.startServer();
  expect(heightOf(await resultRecreated(session, name))).toBeCloseTo(2, 5);
  await session.close();
});

test("undo asks again where the server is away for a moment", async () => {
  const session = await lift();
  await service.stopServer();
  const undone = session.undo().catch((error: unknown) => error);
  await service.startServer();
  // This server has no store: the session is another one, of which the step is not known.
  expect(await undone).toMatchObject({ code: "not_found", reason: "SESSION_UNKNOWN" });
  expect(await settled(session)).toBeCloseTo(5, 5);
  await session.close();
});

test("a snapshot is restored to the same surface and steps, and goes on from there, also where the server loses it", async () => {
  const session = await lift();
  const before = await session.solve({ scalar: "float64", deadlineMs: 20_000 });
  const reader = await joinSession(session.name, { url: service.url });
  const file = await reader.snapshot();
  await reader.close();
  await session.close();

  const restored = await restoreSession(file, { url: service.url });
  expect(restored.name).not.toBe(session.name);
  expect(restored.meshReport.vertices).toBe(400);
  const { value: first } = await restored[Symbol.asyncIterator]().next();
  const far = Math.max(...first!.positions.map((value, k) => Math.abs(value - before.positions[k]!)));
  expect(far).toBeLessThan(1e-3); // or already a step further
  await restored.undo(); // its steps came along
  expect(await settled(restored)).toBeCloseTo(2, 5);

  restored.update(lifted(3)); // of a handle that came with the file alone
  expect(await settled(restored)).toBeCloseTo(3, 5);
  const { name } = restored;
  await service.killServer();
  await service.startServer();
  expect(heightOf(await resultRecreated(restored, name))).toBeCloseTo(3, 5);
  await restored.close();
});

test("what is no snapshot is refused by name", async () => {
  const { url } = service;
  const session = await lift();
  const file = await session.snapshot();
  await session.close();
  await expect(restoreSession(new TextEncoder().encode("nothing of the kind"), { url })).rejects.toMatchObject({
    code: "invalid_argument",
    reason: "SNAPSHOT_FOREIGN",
  });
  await expect(restoreSession(file.subarray(0, file.length - 9), { url })).rejects.toMatchObject({
    reason: "SNAPSHOT_TRUNCATED",
  });
  const changed = file.slice();
  changed[file.length >> 1]! ^= 1;
  await expect(restoreSession(changed, { url })).rejects.toMatchObject({ reason: "SNAPSHOT_DAMAGED" });
});
