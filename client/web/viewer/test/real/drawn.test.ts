import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;
withUser(bar, (one) => (user = one));

/** How colourful a place on the page is: the surface is blue to red, and what is behind it is grey. */
async function colourfulness(place: { x: number; y: number }): Promise<number> {
  const channels = await user.colourAt(place);
  return Math.max(...channels) - Math.min(...channels);
}

it("the surface is drawn where it is after a brush has highlighted vertices", async () => {
  const front = await user.vertexNear([0.5, 0, 4]);
  const before = await user.vertexOnPage(front);
  expect(await colourfulness(before)).toBeGreaterThan(70);
  await user.ask(`app.view.set({ tool: "brush", selected: undefined })`);
  await user.drag(await user.vertexOnPage(await user.vertexNear([0.5, 0, 0.7])), 0, -5);
  await user.ask(`app.view.set({ tool: "move" })`);
  const [top] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(top!), -230, 60);
  await user.settled();
  const after = await user.vertexOnPage(front);
  expect(before.x - after.x).toBeGreaterThan(100);
  await user.page.mouse.move(5, 5);
  expect(await colourfulness(after)).toBeGreaterThan(70);
  expect(await colourfulness({ x: before.x + 30, y: before.y })).toBeLessThan(40);
});
