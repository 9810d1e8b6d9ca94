import { afterAll, beforeAll, expect, test } from "vitest";
import {
  type BetterShapeNotice,
  type Frame,
  type MinimaSearch,
  type Notice,
  openSession,
  type Session,
} from "../../src/index.js";
import { Service } from "../support/service.js";
import { box } from "../support/shapes.js";

const leastShare = 0.001;

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

/** The next final frame whose energy is lower by at least the least share. Others may come before it. */
async function lowerThan(first: Frame, session: Session): Promise<Frame> {
  for await (const frame of session) if (frame.isFinal && frame.energy <= (1 - leastShare) * first.energy) return frame;
  throw new Error("no better shape came");
}

/** A bar of which one end is turned by 80 degrees. The first minimum that the solver comes to is 2 % above another one. */
async function bent(search: MinimaSearch): Promise<Session> {
  const { mesh, bottom, top } = box(6, 40);
  const solver = { search: { leastShare, ...search } };
  const session = await openSession(mesh, { url: service.url, settings: { p: 1.5, solver } });
  const motion = { axis: [1, 0, 0], angle: (80 * Math.PI) / 180, center: [3, 3, 20] } as const;
  session.setHandles({ bottom: { vertices: bottom }, top: { vertices: top, motion } });
  return session;
}

test("a session in which nothing changes announces a better shape, which is taken once", async () => {
  const session = await bent({ effort: 2 });
  const first = await session.settle({ timeoutMs: 20_000 });
  const notice = await new Promise<BetterShapeNotice>((resolve) => {
    const look = (said?: Notice) => said?.reason === "better_shape" && resolve(said);
    session.on("notice", look);
    look(session.notice); // it may be there already
  });
  expect(notice.inputSeq).toBe(first.inputSeq);
  expect(notice.savedShare).toBeCloseTo(1 - notice.energy / first.energy, 12);
  const taken = await session.takeBetterShape();
  expect(taken.inputSeq).toBe(first.inputSeq);
  expect(taken.energy).toBeLessThanOrEqual(notice.energy); // a further start may have found a lower one meanwhile
  expect(session.notice?.reason).not.toBe("better_shape");
  expect(await lowerThan(first, session)).toMatchObject({ isFinal: true, ...taken });
  await expect(session.takeBetterShape()).rejects.toMatchObject({ reason: "NO_BETTER_SHAPE" });
  await session.close();
});

test("a better shape is shown at once if that is asked for", async () => {
  const session = await bent({ effort: 0 });
  const first = await session.settle({ timeoutMs: 20_000 });
  const inputSeq = session.set({ solver: { search: { leastShare, effort: 2, show: true } } });
  expect(await lowerThan(first, session)).toMatchObject({ isFinal: true, inputSeq });
  await session.close();
});

test("a solve says which minima it has seen", async () => {
  const session = await bent({ effort: 1 });
  const result = await session.solve({ deadlineMs: 20_000 });
  expect(result.furtherStarts).toBe(12);
  expect(result.energy).toBe(Math.min(...result.minima));
  await session.close();
});
