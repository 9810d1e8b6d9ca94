import { expect, it } from "vitest";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withUser(bar, (one) => (user = one));

it("warnings about a mesh are in sight as soon as it is open, at 1280 x 800", async () => {
  // Two tetrahedra that share nothing but a vertex.
  const corners = ["0 0 0", "1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1"];
  const faces = ["1 3 2", "1 2 4", "1 4 3", "2 3 4", "1 5 6", "1 6 7", "1 7 5", "5 7 6"];
  const content = [...corners.map((place) => `v ${place}`), ...faces.map((face) => `f ${face}`)].join("\n");
  await user.openFiles({ name: "touching.obj", content });
  const warning = user.page.locator(".warned .warnings button").first();
  await warning.waitFor();
  const { y, height } = (await warning.boundingBox())!;
  expect(y + height).toBeLessThan(800);
  await user.page.locator("canvas.stage").focus();
  await user.page.getByLabel("Shape").selectOption("bar");
  await user.settled();
  expect(await user.page.locator(".panel > details").last().textContent()).toContain("Nothing wrong with it.");
});
