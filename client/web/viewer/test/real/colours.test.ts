import { expect, it } from "vitest";
import type { Service } from "../../../client/test/support/service.js";
import { bar, withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let service: Service;
let user: User;

withNewUsers(bar, (one, started) => ([user, service] = [one, started]));

const palette = () => user.page.getByLabel("Palette");

it("with the palette from dark to bright the surface has no blue and no red, and the choice stays", async () => {
  const rest = await user.colours();
  expect(rest.cold).toBeGreaterThan(0.5);
  await palette().selectOption("viridis");
  const side = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.5]));
  await user.page.mouse.move(5, 400);
  const isViolet = async () => {
    const [r, g, b] = await user.colourAt(side);
    return r + b > 4 * g;
  };
  await expect.poll(isViolet, { timeout: 60_000 }).toBe(true); // the least is dark violet
  expect(await user.page.locator(".legend-bar").evaluate((bar) => getComputedStyle(bar).backgroundImage)).toContain(
    "253, 231, 37",
  );
  await user.page.goto(`${service.url}/?shape=block&detail=coarse`);
  await user.settled();
  expect(await palette().inputValue()).toBe("viridis");
});

it("the pointer reads distortion and p of the vertex under it, and the cross does", async () => {
  const readout = user.page.locator(".readout");
  const vertex = await user.vertexNear([0.5, 0, 2.5]);
  const { x, y } = await user.vertexOnPage(vertex);
  await user.page.mouse.move(x, y);
  await readout.filter({ hasText: `Vertex ${vertex} · distortion` }).waitFor();
  await user.page.keyboard.press(".");
  await readout.filter({ hasText: "p 1.6" }).waitFor();
  await user.page.mouse.move(5, 400);
  await readout.waitFor({ state: "hidden" });
  await user.page.mouse.move(x, y);
  await readout.waitFor();
  await user.page.keyboard.press("v");
  await readout.waitFor({ state: "hidden" });
  await user.page.keyboard.press("v");
  const gizmo = await user.ask<{ x: number; y: number }>("anchorOnPage()");
  await user.page.mouse.move(gizmo.x, gizmo.y);
  await readout.waitFor();
  await user.page.mouse.down();
  await readout.waitFor({ state: "hidden" }); // what it said is not so during the drag
  await user.page.mouse.up();
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("Enter");
  await readout.filter({ hasText: /^Vertex \d+ · distortion/ }).waitFor();
  expect(await readout.getAttribute("aria-live")).toBe("polite");
  await user.page.keyboard.press("Escape");
  await readout.waitFor({ state: "hidden" });
});
