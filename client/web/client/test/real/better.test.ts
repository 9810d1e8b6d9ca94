import { afterAll, beforeAll, expect, test } from "vitest";
import { type BetterShapeNotice, type MinimaSearch, openSession, type Session } from "../../src/index.js";
import { Service } from "../support/service.js";
import { box } from "../support/shapes.js";

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

/** A bar of which one end is turned by 80 degrees. The first minimum that the solver comes to is 2 % above another one. */
async function bent(search: MinimaSearch): Promise<Session> {
  const { mesh, bottom, top } = box(6, 40);
  const solver = { search: { leastShare: 0.001, ...search } };
  const session = await openSession(mesh, { url: service.url, settings: { p: 1.5, solver } });
  const motion = { axis: [1, 0, 0], angle: (80 * Math.PI) / 180, center: [3, 3, 20] } as const;
  session.setHandles({ bottom: { vertices: bottom }, top: { vertices: top, motion } });
  return session;
}

test("a session in which nothing changes announces a better shape, which is taken once", async () => {
  const session = await bent({ effort: 2 });
  const first = await session.settle({ timeoutMs: 20_000 });
  const notice = await new Promise<BetterShapeNotice>((resolve) => {
    session.on("notice", (said) => said?.reason === "better_shape" && resolve(said));
  });
  expect(notice.inputSeq).toBe(first.inputSeq);
  expect(notice.savedShare).toBeCloseTo(1 - notice.energy / first.energy, 12);
  expect(await session.takeBetterShape()).toEqual({ inputSeq: first.inputSeq, energy: notice.energy });
  expect(session.notice).toBeUndefined();
  const { value: shown } = await session[Symbol.asyncIterator]().next();
  expect(shown).toMatchObject({ isFinal: true, inputSeq: first.inputSeq, energy: notice.energy });
  await expect(session.takeBetterShape()).rejects.toMatchObject({ reason: "NO_BETTER_SHAPE" });
  await session.close();
});

test("a better shape is shown at once if that is asked for", async () => {
  const session = await bent({ effort: 2, show: true });
  const first = await session.settle({ timeoutMs: 20_000 });
  const { value: shown } = await session[Symbol.asyncIterator]().next();
  expect(shown).toMatchObject({ isFinal: true, inputSeq: first.inputSeq });
  expect(shown!.energy).toBeLessThan(first.energy);
  await session.close();
});

test("a solve says which minima it has seen", async () => {
  const session = await bent({ effort: 1 });
  const result = await session.solve({ deadlineMs: 20_000 });
  expect(result.furtherStarts).toBe(8);
  expect(result.energy).toBe(Math.min(...result.minima));
  await session.close();
});
