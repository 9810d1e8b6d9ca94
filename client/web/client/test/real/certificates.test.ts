import { afterAll, beforeAll, expect, test } from "vitest";
import { type Frame, openSession } from "../../src/index.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

const { mesh, handles } = grid(12);
const bent = { ...handles, right: { ...handles.right, motion: { axis: [0, 1, 0] as const, angle: 1 } } };

test("a result that stands comes again with its gap, each result with its own", async () => {
  const session = await openSession(mesh, { url: service.url, certify: true });
  let last = -1;
  for (const p of [1.5, 4]) {
    session.set({ p });
    const input = session.setHandles(bent);
    const result = await session.settle({ timeoutMs: 20_000 });
    let certified: Frame = result;
    // A slow reader may get the result only with its gap, and nothing comes after it.
    if (result.optimalityGap === undefined) {
      for await (const frame of session) {
        certified = frame;
        if (frame.optimalityGap !== undefined) break;
      }
    }
    expect(certified).toMatchObject({ inputSeq: input, isFinal: true, energy: result.energy });
    expect([...certified.positions]).toEqual([...result.positions]);
    expect(certified.frameSeq).toBeGreaterThan(last);
    // Not looser than what Solve finds for the same.
    const solved = await session.solve({ certify: true });
    expect(certified.optimalityGap).toBeGreaterThanOrEqual(0);
    expect(certified.optimalityGap).toBeLessThan(Math.max(10 * solved.optimalityGap!, 0.01));
    last = certified.frameSeq;
  }
  await session.close();
});

test("who did not ask gets none", async () => {
  const [asking, other] = await Promise.all([
    openSession(mesh, { url: service.url, certify: true }),
    openSession(mesh, { url: service.url }),
  ]);
  for (const session of [asking, other]) session.setHandles(bent);
  const frames: Frame[] = [await other.settle({ timeoutMs: 20_000 })];
  for await (const frame of asking) if (frame.optimalityGap !== undefined) break;
  for (let frame = other.poll(); frame; frame = other.poll()) frames.push(frame);
  expect(frames.every(({ optimalityGap }) => optimalityGap === undefined)).toBe(true);
  await Promise.all([asking.close(), other.close()]);
});
