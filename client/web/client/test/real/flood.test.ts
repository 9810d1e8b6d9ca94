import { spawn } from "node:child_process";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { afterAll, beforeAll, expect, test } from "vitest";
import { openSession } from "../../src/index.js";
import { Service } from "../support/service.js";
import { grid } from "../support/shapes.js";

const pauseMs = 5000;

interface Line {
  inputSeq?: number;
  wireBytes?: number;
  receivedBytes: number;
  at?: number;
  pauses?: number;
  resumes?: number;
}

let service: Service;
beforeAll(async () => {
  service = await Service.start();
});
afterAll(() => service.stop());

/** What a reader sees that does nothing for five seconds while the mesh is being dragged; when each update was made. */
async function flood(credit: number): Promise<{ lines: Line[]; madeAt: Map<number, number> }> {
  const { mesh, handles } = grid(100);
  const session = await openSession(mesh, { url: service.url, settings: { p: 2 } });
  session.setHandles(handles);
  const madeAt = new Map<number, number>();
  let tick = 0;
  const dragging = setInterval(() => {
    const height = 10 * Math.sin(++tick / 50);
    madeAt.set(session.move("right", { translation: [0, 0, height] }), Date.now());
  }, 10);
  const program = join(import.meta.dirname, "slow_reader.ts");
  const child = spawn(process.execPath, [program, service.url, session.name, String(credit), String(pauseMs)], {
    stdio: ["ignore", "pipe", "inherit"],
  });
  const lines: Line[] = [];
  for await (const line of createInterface({ input: child.stdout })) lines.push(JSON.parse(line));
  clearInterval(dragging);
  await session.close();
  return { lines, madeAt };
}

test.each([1, 2, 8])(
  "a reader of credit %i that pauses gets a fresh frame as soon as it goes on",
  async (credit) => {
    const { lines, madeAt } = await flood(credit);
    const resumed = lines.findIndex(({ resumes }) => resumes !== undefined);
    const resumedAt = lines[resumed]!.resumes!;
    const after = lines.slice(resumed + 1) as Required<Line>[];
    expect(after.length).toBe(20);
    // Fresh: it answers an update of the second half of the pause, or a later one. Frames that were held on the way are older.
    const isFresh = ({ inputSeq }: Required<Line>) => (madeAt.get(inputSeq) ?? 0) > resumedAt - pauseMs / 2;
    const first = after.findIndex(isFresh);
    expect(first).toBeGreaterThanOrEqual(0);
    expect(first).toBeLessThanOrEqual(credit);
    expect(after.slice(first).every(isFresh)).toBe(true);
    const frameBytes = after[first]!.wireBytes;
    // The older frames, and what came and was never taken. Frames that came with the newest are taken after it.
    const bytesOf = (part: Required<Line>[]) => part.reduce((sum, { wireBytes }) => sum + wireBytes, 0);
    const untaken = after.map(
      ({ receivedBytes }, k) => receivedBytes - lines[resumed]!.receivedBytes - bytesOf(after.slice(0, k + 1)),
    );
    const held = bytesOf(after.slice(0, first)) + Math.min(...untaken.slice(first));
    expect(held).toBeLessThanOrEqual(credit * (frameBytes + 1024) + 1024);
    console.log(
      `credit ${credit}: ${first} older frames, ${(held / 1024).toFixed(0)} KiB held on the way, ` +
        `the newest ${after[first]!.at - resumedAt} ms after the pause, ` +
        `${after[first]!.at - madeAt.get(after[first]!.inputSeq)!} ms after its update`,
    );
  },
  60_000,
);
