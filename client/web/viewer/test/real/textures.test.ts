import { expect, it } from "vitest";
import { columns, makeGlb } from "../made_glb.js";
import { pngOf } from "../png.js";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;
withUser(bar, (one) => (user = one));

const button = (name: string) => user.page.getByRole("button", { name, exact: true });
const isRed = ([r, g]: readonly number[]) => r! > 100 && g! < 60;
const isGreen = ([r, g]: readonly number[]) => g! > 100 && r! < 60;

it("clay is lit as seen by the viewer, and a mesh without materials has no texture to show", async () => {
  expect(await button("Texture").isDisabled()).toBe(true);
  await button("Clay").click();
  await user.page.mouse.move(5, 400);
  const place = await user.vertexOnPage(await user.vertexNear([0.5, 0, 2.5]));
  await expect
    .poll(
      async () => {
        const [r, g, b] = await user.colourAt(place);
        return r > g && g > b;
      },
      { timeout: 20_000 },
    )
    .toBe(true);
  expect(await user.page.locator(".legend").isHidden()).toBe(true);
  if (process.env["SHOT"]) await user.page.screenshot({ path: `${process.env["SHOT"]}-clay.png` });
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("c");
  expect(await user.ask("app.view.now.colourBy")).toBe("plain");
});

it("the texture of a GLB is shown where the file has it, and bends with the surface", async () => {
  const picture = pngOf(2, 1, [255, 0, 0, 0, 255, 0]);
  await user.openInstead({ name: "tube.glb", content: Buffer.from(makeGlb(false, picture)) });
  await user.ask("app.view.set({ isYUp: true })");
  await button("Texture").click();
  const at = async (column: number) => user.vertexOnPage(8 * (columns + 1) + column);
  await button("Front").click();
  await user.page.mouse.move(5, 400);
  await expect.poll(async () => isRed(await user.colourAt(await at(3))), { timeout: 20_000 }).toBe(true);
  await button("Back").click();
  await expect.poll(async () => isGreen(await user.colourAt(await at(9))), { timeout: 20_000 }).toBe(true);
  await button("Front").click();
  const top = Array.from({ length: columns + 1 }, (_, column) => 16 * (columns + 1) + column);
  const bottom = Array.from({ length: columns + 1 }, (_, column) => column);
  const handles = {
    handles: [
      { name: "base", vertices: bottom },
      { name: "top", vertices: top, translate: [0, 0, 0] },
    ],
  };
  await user.openFiles({ name: "h.json", content: JSON.stringify(handles) });
  await user.handlesCame("top");
  const before = await at(3);
  await user.page.locator('[data-handle="top"] .name').click();
  await user.page.getByLabel("Moved along x").fill("1.5");
  await user.page.getByLabel("Moved along x").press("Enter");
  await user.settled();
  await user.ask("app.view.set({ selected: undefined })");
  await user.page.mouse.move(5, 400);
  const after = await at(3);
  expect(after.x).toBeGreaterThan(before.x + 20);
  await expect.poll(async () => isRed(await user.colourAt(after)), { timeout: 20_000 }).toBe(true);
  if (process.env["SHOT"]) await user.page.screenshot({ path: `${process.env["SHOT"]}-texture.png` });
  await button("Distortion").click();
  await expect.poll(async () => isRed(await user.colourAt(after)), { timeout: 20_000 }).toBe(false);
  await button("Texture").click();
  await user.ask(`app.openShape("sheet", "coarse")`);
  expect(await user.ask("app.view.now.colourBy")).toBe("distortion");
});

it("the images of an OBJ are shown if they are opened with it and its MTL, also after a reload; one that is missing is named", async () => {
  const [across, along] = [8, 8];
  const lines = ["mtllib sheet.mtl", "usemtl picture"];
  for (let row = 0; row <= along; ++row) {
    for (let column = 0; column <= across; ++column) {
      lines.push(`v ${column} 0 ${row}`, `vt ${column / across} ${row / along}`);
    }
  }
  for (let row = 0; row < along; ++row) {
    for (let column = 1; column <= across; ++column) {
      const [a, b] = [row * (across + 1) + column, (row + 1) * (across + 1) + column];
      lines.push(`f ${a}/${a} ${a + 1}/${a + 1} ${b + 1}/${b + 1} ${b}/${b}`);
    }
  }
  const sheet = { name: "sheet.obj", content: `${lines.join("\n")}\n` };
  const mtl = { name: "sheet.mtl", content: "newmtl picture\nKd 1 1 1\nmap_Kd -clamp on maps/picture.png\n" };
  await user.openInstead(sheet, mtl);
  await button("Texture").click();
  await user.page
    .locator(".notice", { hasText: "Open these images together with sheet.obj to see them: maps/picture.png" })
    .waitFor();
  await button("Distortion").click();
  await user.openInstead(sheet, mtl, { name: "picture.png", content: Buffer.from(pngOf(2, 1, [255, 0, 0, 0, 255, 0])) });
  await user.until(`Object.keys(window.__lpdeform.app.mesh.materials ?? {}).length === 2`);
  await user.ask("app.view.set({ isYUp: false })");
  await button("Texture").click();
  await button("Front").click();
  const at = (column: number) => user.vertexOnPage(4 * (across + 1) + column);
  const shown = async () => {
    await user.page.mouse.move(5, 400);
    await expect.poll(async () => isRed(await user.colourAt(await at(2))), { timeout: 20_000 }).toBe(true);
    await expect.poll(async () => isGreen(await user.colourAt(await at(6))), { timeout: 20_000 }).toBe(true);
  };
  await shown();
  const project = { name: "sheet.lpdeform", content: await user.save("Project, to go on with (Ctrl+S)") };
  await user.ask(`app.openShape("sheet", "coarse")`);
  await user.openInstead(project);
  await user.until(`Object.keys(window.__lpdeform.app.mesh.materials ?? {}).length === 2`);
  await shown();
  const { x, y } = await at(4);
  await user.page.locator("canvas.stage").focus();
  await user.page.keyboard.press("1");
  await user.page.mouse.click(x, y);
  await user.until("window.__lpdeform.document().handles.length === 1");
  await user.page.waitForTimeout(700);
  await user.page.reload();
  await user.until(`window.__lpdeform?.app.mesh.name === "sheet.obj"`);
  expect(await user.ask("app.view.now.colourBy")).toBe("texture");
  await shown();

  const mark = () =>
    user.page.evaluate("localStorage.getItem('lpdeform-restoring-' + sessionStorage.getItem('lpdeform-work'))");
  expect(await mark()).toBe(null);
  // A page that stops over its textures asks the next time.
  await user.page.addInitScript("createImageBitmap = () => ((window.isDecoding = true), new Promise(() => undefined))");
  await user.page.reload();
  await user.until("window.isDecoding && window.__lpdeform?.app.panes[0].frame");
  await user.page.waitForTimeout(500);
  expect(await mark()).toBe("yes");
  expect(user.errors).toEqual([]);
});

it("an image of a few bytes that would take gigabytes is not decoded, and it is said", async () => {
  const content = "mtllib huge.mtl\nv 0 0 0\nv 1 0 0\nv 0 0 1\nvt 0 0\nusemtl huge\nf 1/1 2/1 3/1\n";
  await user.openFiles(
    { name: "huge.obj", content },
    { name: "huge.mtl", content: "newmtl huge\nmap_Kd huge.png\n" },
    { name: "huge.png", content: Buffer.from(pngOf(30_000, 30_000, [255, 0, 0])) },
  );
  await user.until(`window.__lpdeform.app.mesh.name === "huge.obj"`);
  await user.ask("app.view.set({ colourBy: 'texture' })");
  await user.page.locator(".notice", { hasText: "One texture of huge.obj cannot be shown: too large" }).waitFor();
});
