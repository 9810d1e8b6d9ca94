import { join } from "node:path";
import { afterAll, beforeAll, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { ringObj, ringVertex } from "../support/ring.js";
import { User } from "./user.js";

// While a solve takes longer than a moment, the page shows how much of it is left, and its end.

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=sheet&detail=coarse`);
  await user.settled();
});

afterAll(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
  await service.stop();
});

it("what is left goes down from frame to frame, and then it is settled", async () => {
  const [around, across] = [260, 110];
  await user.openFiles({ name: "ring.obj", content: ringObj(around, across) });
  await user.until(`window.__lpdeform.app.mesh.name === "ring.obj"`);
  for (const turn of [0.62, 0.88]) {
    const { x, y } = await user.vertexOnPage(ringVertex(around, across, turn, 0.2));
    await user.page.mouse.click(x, y);
  }
  await user.settled();
  await user.page.evaluate(() => {
    const { app } = (window as any).__lpdeform;
    const seen: unknown[] = [];
    Object.assign(window, { __seen: seen });
    const pill = document.querySelector<HTMLElement>(".pill")!;
    new MutationObserver(() => seen.push(pill.innerText.replace(/\s+/g, " "))).observe(pill, {
      characterData: true,
      childList: true,
      subtree: true,
    });
    const last = app.document.handles.at(-1);
    const handles = app.document.handles.map((one: { name: string; pose: object }) =>
      one === last ? { ...one, pose: { ...one.pose, translation: [0.9, -0.6, 0.5] } } : one,
    );
    app.change({ ...app.document, handles, p: 1.1 });
  });
  await user.until(`window.__seen.includes("Settled")`, 100_000);
  await user.until(`document.querySelector(".pill").innerText.trim() === "Live"`);
  const seen = (await user.page.evaluate("window.__seen")) as string[];
  const shares = seen.map((text) => /^Solving ([\d.]+) % left$/.exec(text)?.[1]).filter((share) => share !== undefined);
  expect(shares.length).toBeGreaterThan(1);
  const numbers = shares.map(Number);
  expect(numbers).toEqual(numbers.toSorted((a, b) => b - a));
  expect(seen.lastIndexOf("Settled")).toBeGreaterThan(seen.findIndex((text) => text.startsWith("Solving")));
});

it("nothing is said of a solve while the server is away", async () => {
  const told = `(window.__lpdeform.app.facts.set({ solving: { left: 0.4 } }), document.querySelector(".pill").innerText)`;
  expect(await user.page.evaluate(told)).toMatch(/40/);
  await service.killServer();
  await user.until(`document.querySelector(".pill").innerText.trim() === "The server is away"`);
  expect(await user.page.locator(".pill .left").innerText()).toBe("");
});
