import { join } from "node:path";
import { afterAll, beforeAll, beforeEach, describe, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { decodePng, User } from "./user.js";

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
});

afterAll(async () => {
  await user.close();
  await service.stop();
});

beforeEach(async () => {
  await user.settled();
});

interface HandleFacts {
  name: string;
  colour: string;
  vertices: number[];
  isLocked: boolean;
  hold: { kind: string; weight?: number };
  pose: { translation: [number, number, number]; rotation: [number, number, number, number] };
}

const handles = () => user.ask<HandleFacts[]>("document().handles");
const selected = () => user.ask<string | undefined>("app.view.now.selected");
const press = (key: string) => user.page.keyboard.press(key);
const frontAt = async (height: number) => user.vertexOnPage(await user.vertexNear([0.5, 0, height]));

describe("handles", () => {
  it("are painted with the brush", async () => {
    await press("2");
    const [from, to] = [await frontAt(2), await frontAt(3)];
    await user.drag(from, to.x - from.x, to.y - from.y);
    const [, , painted] = await handles();
    expect(painted!.vertices.length).toBeGreaterThan(3);
    expect(await selected()).toBe(painted!.name);
  });

  it("grow with Shift and shrink with Alt", async () => {
    const before = (await handles())[2]!.vertices.length;
    const [from, to] = [await frontAt(3), await frontAt(4)];
    await user.page.keyboard.down("Shift");
    await user.drag(from, to.x - from.x, to.y - from.y);
    await user.page.keyboard.up("Shift");
    const grown = (await handles())[2]!.vertices.length;
    expect(grown).toBeGreaterThan(before);
    await user.page.keyboard.down("Alt");
    await user.drag(from, to.x - from.x, to.y - from.y);
    await user.page.keyboard.up("Alt");
    expect((await handles())[2]!.vertices.length).toBeLessThan(grown);
  });

  it("are renamed, coloured, locked, held softly and deleted in the list", async () => {
    const row = user.page.locator(".handles li").nth(2);
    const { colour } = (await handles())[2]!;
    await row.getByLabel("Name").fill("Middle");
    await row.getByLabel("Name").press("Enter");
    await user.page.locator('.handles li[data-handle="Middle"]').waitFor();
    await user.page.getByLabel("Colour of Middle").click();
    await user.page.getByLabel("How it is held").selectOption("soft");
    await user.page.locator('[data-handle="Middle"]').getByTitle("Lock it against dragging").click();
    const [, , middle] = await handles();
    expect(middle).toMatchObject({ name: "Middle", isLocked: true, hold: { kind: "soft", weight: 1 } });
    expect(middle!.colour).not.toBe(colour);
    await user.settled();
    expect(await user.ask("status()")).toBe("live");
    await row.getByLabel("Name").fill("Top");
    await row.getByLabel("Name").press("Enter");
    await user.page.locator(".notice.bad", { hasText: "There is a handle “Top” already." }).waitFor();
    await user.page.getByLabel("Delete Middle").click();
    expect((await handles()).length).toBe(2);
  });

  it("are drawn around with the lasso", async () => {
    await press("3");
    const middle = await frontAt(2.6);
    const { mouse } = user.page;
    await mouse.move(middle.x - 30, middle.y - 20);
    await mouse.down();
    for (const [x, y] of [
      [60, -20],
      [60, 30],
      [-30, 30],
      [-30, -10],
    ])
      await mouse.move(middle.x + x!, middle.y + y!);
    await mouse.up();
    expect((await handles()).length).toBe(3);
    await press("Delete");
    expect((await handles()).length).toBe(2);
  });
});

describe("points inside faces, from a file", () => {
  const content = JSON.stringify({
    handles: [
      { name: "Base", vertices: [...Array(25).keys()] },
      { name: "Pin", points: [{ face: 0, barycentric: [0.2, 0.3, 0.5] }] },
    ],
  });
  const middle = "app.mesh.faces.slice(3 * POINT.face, 3 * POINT.face + 3)";
  /** Where the point is on the surface as it is drawn. */
  const place = async (): Promise<number[]> => {
    const [face, weights] = await user.ask<[number, number[]]>(
      "document().handles[1].points.map(({ face, barycentric }) => [face, barycentric])[0]",
    );
    const corners = Object.values(await user.ask<Record<string, number>>(middle.replaceAll("POINT.face", String(face))));
    const positions = await user.positions();
    return [0, 1, 2].map((axis) => corners.reduce((sum, vertex, k) => sum + weights[k]! * positions[3 * vertex + axis]!, 0));
  };
  const onPage = ([x, y, z]: number[]) => user.ask<{ x: number; y: number }>(`pointOnPage([${x}, ${y}, ${z}])`);

  it("are drawn in their handle's colour, and dragged", async () => {
    const mesh = await user.ask<{ faces: Record<string, number>; positions: Record<string, number> }>("app.mesh");
    const front = await user.vertexNear([0.5, 0, 3.2]);
    const faces = Object.values(mesh.faces);
    const face = Math.floor(faces.findIndex((vertex, k) => vertex === front && isInFront(k)) / 3);
    function isInFront(corner: number): boolean {
      const first = corner - (corner % 3);
      return faces.slice(first, first + 3).every((vertex) => mesh.positions[3 * vertex + 1] === mesh.positions[3 * front + 1]);
    }
    await user.openFiles({ name: "pin.json", content: content.replace('"face":0', `"face":${face}`) });
    await user.handlesCame("Pin");
    await press("1");
    await press("Escape"); // without the gizmo over it
    const start = await onPage(await place());
    const hex = await user.ask<string>("document().handles[1].colour");
    const wanted = [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
    await expect
      .poll(async () => Math.max(...(await user.colourAt(start)).map((value, k) => Math.abs(value - wanted[k]!))))
      .toBeLessThan(12);

    const before = await place();
    await user.drag(start, 40, -20);
    await user.settled();
    const { translation } = (await handles())[1]!.pose;
    expect(Math.hypot(...translation)).toBeGreaterThan(0.1);
    const after = await place();
    for (const axis of [0, 1, 2]) expect(after[axis]! - before[axis]!).toBeCloseTo(translation[axis]!, 2);
    await user.page.getByLabel("How it is held").waitFor();
    expect(await user.page.getByLabel("How it is held").locator("option").allTextContents()).toEqual(["Exactly", "Softly"]);
  });

  it("can be undone", async () => {
    await press("Control+z");
    await press("Control+z");
    expect((await handles()).map(({ name }) => name)).toEqual(["Base", "Top"]);
  });
});

describe("the gizmo", () => {
  it("moves along an axis and turns about one", async () => {
    await press("1");
    await press("t");
    await user.page.locator('[data-handle="Top"] .name').click();
    await user.page.locator("canvas.stage").focus();
    const before = (await handles())[1]!.pose.translation;
    const top = await user.ask<{ x: number; y: number }>("anchorOnPage()");
    await user.drag({ x: top.x, y: top.y - 55 }, 0, -40);
    const after = (await handles())[1]!.pose.translation;
    expect(after[2]).toBeGreaterThan(before[2] + 0.05);
    expect(Math.abs(after[0] - before[0])).toBeLessThan(1e-6);
    await user.settled();
    await press("r");
    const again = await user.ask<{ x: number; y: number }>("anchorOnPage()");
    await user.drag({ x: again.x + 3, y: again.y - 6 }, 60, 20);
    await user.settled();
    const turned = (await handles())[1]!.pose.rotation;
    expect(Math.abs(turned[3])).toBeLessThan(0.999);
    expect(await user.ask("app.red")).toBeGreaterThan(0);
  });

  it("gives way to keys", async () => {
    const before = (await handles())[1]!.pose.translation;
    await press("t");
    await user.page.locator("canvas.stage").focus();
    await press("ArrowRight");
    const after = (await handles())[1]!.pose.translation;
    expect(after[0] - before[0]).toBeCloseTo(0.01 * (await user.ask<number>("app.diagonal")), 9);
    await press("Control+z");
    expect((await handles())[1]!.pose.translation).toEqual(before);
  });
});

describe("p", () => {
  it("is painted, with stiffness beside it, and taken away again", async () => {
    await press("5");
    const [from, to] = [await frontAt(1), await frontAt(2)];
    await user.drag(from, to.x - from.x, to.y - from.y);
    await user.settled();
    const painted = await user.ask<Record<string, number>>("document().paintedP");
    expect(Object.values(painted).filter((value) => value === 1).length).toBeGreaterThan(2);
    expect(await user.ask("app.view.now.colourBy")).toBe("p");
    await user.page.getByRole("group", { name: "What is painted" }).getByRole("button", { name: "Stiffness" }).click();
    await user.drag(from, to.x - from.x, to.y - from.y);
    await user.settled();
    const stiffness = await user.ask<Record<string, number>>("document().stiffness");
    expect(Math.max(...Object.values(stiffness))).toBe(10);
    await user.page.getByRole("button", { name: "Clear painting" }).click();
    expect(await user.ask("document().paintedP")).toBeUndefined();
    await user.page.getByRole("button", { name: "Distortion" }).click();
  });

  it("is found from the shape", async () => {
    const before = await user.positions();
    await user.page.locator(".dock .toggle").click();
    expect(await user.ask("document().isAutomatic")).toBe(true);
    await user.settled();
    expect(await user.positions()).not.toEqual(before);
    await press("a");
    expect(await user.ask("document().isAutomatic")).toBe(false);
  });

  it("has two values side by side, with the same handles", async () => {
    await press("s");
    await user.settled(1);
    const [left, right] = [await user.positions(0), await user.positions(1)];
    expect(right.length).toBe(left.length);
    expect(Math.max(...right.map((value, k) => Math.abs(value - left[k]!)))).toBeGreaterThan(0.01);
    const { vertices } = (await handles())[1]!;
    for (const vertex of vertices) expect(Math.abs(right[3 * vertex]! - left[3 * vertex]!)).toBeLessThan(1e-3);
    await press("1");
    const from = await user.vertexOnPage(vertices[0]!, 1);
    await user.drag(from, 40, 20);
    await user.settled(0);
    await user.settled(1);
    expect(await user.positions(0)).not.toEqual(left);
    expect(await user.positions(1)).not.toEqual(right);
    // Each has a name, and a histogram of its own.
    const label = (pane: number) => user.page.locator("canvas.stage").nth(pane).getAttribute("aria-label");
    const { p: leftP, secondP } = await user.ask<{ p: number; secondP: number }>("document()");
    expect(await label(0)).toBe(`Left picture of the surface, p = ${leftP}`);
    expect(await label(1)).toBe(`Right picture of the surface, p = ${secondP}`);
    const captions = user.page.locator(".measures figcaption", { hasText: "Cells by energy" });
    expect(await captions.allTextContents()).toEqual([
      `Cells by energy, left: p = ${leftP}`,
      `Cells by energy, right: p = ${secondP}`,
    ]);
    const bars = (k: number) =>
      captions.nth(k).evaluate((caption) => (caption.nextElementSibling as HTMLCanvasElement).toDataURL());
    expect(await bars(0)).not.toBe(await bars(1));
    // Both are in an exported picture, each with its name in the upper right corner.
    const picture = decodePng(await user.save("Picture as PNG"));
    const pane = (await user.page.locator("canvas.stage").first().boundingBox())!;
    const ratio = picture.height / pane.height;
    expect(ratio).toBeCloseTo(2, 1); // fine, though it has only just moved
    expect(Math.abs(picture.width / ratio - 2 * pane.width)).toBeLessThan(2);
    for (const right of [pane.width, 2 * pane.width]) {
      let dark = 0;
      for (let y = 10 * ratio; y < 40 * ratio; ++y) {
        for (let x = Math.round((right - 80) * ratio); x < (right - 10) * ratio; ++x) {
          if (picture.pixels[(Math.round(y) * picture.width + x) * picture.channels]! < 90) ++dark;
        }
      }
      expect(dark).toBeGreaterThan(50);
    }
    // The plot compares lengths: the p-th roots of the energies.
    for (const [pane, p] of [await user.ask<number>("document().p"), await user.ask<number>("document().secondP")].entries()) {
      const { energy } = (await user.frame(pane))!;
      expect(await user.ask(`app.panes[${pane}].trail.energies.at(-1)`)).toBeCloseTo(energy ** (1 / p), 9);
    }
    // The server looks for the gaps by itself, once all rests.
    await user.until("[0, 1].every((pane) => window.__lpdeform.frame(pane).gap !== undefined)");
    await expect.poll(() => user.page.locator('[data-measure="gap"]').textContent()).toMatch(/^[^–]* %/);
    await expect.poll(() => user.page.locator('[data-measure="lower"]').textContent()).toMatch(/^(may exist|known, )/);
    await press("s");
    await expect.poll(() => user.page.locator(".measures figcaption:visible").allTextContents()).toContain("Cells by energy");
    expect(await label(0)).toBe(`Picture of the surface, p = ${leftP}`);
  });
});

describe("how far to look for lower minima", () => {
  it("is chosen in the side panel, and the server takes it", async () => {
    const panel = user.page.locator(".panel details", { hasText: "Lower minima" });
    await panel.locator("summary").click();
    const chosen = () => user.ask("app.view.now.search");
    const looks = panel.getByLabel("How far to look for lower minima");
    await looks.selectOption({ label: "48 starts" });
    await panel.getByLabel("Least saving of energy").selectOption({ label: "at least 5\u00a0%" });
    await panel.getByText("Show at once").click();
    expect(await chosen()).toEqual({ effort: 4, leastShare: 0.05, show: true });
    await user.settled();
    expect(await user.ask("app.facts.now.problem")).toBeUndefined();
    await user.ask("app.view.set({ search: { effort: 7 } })"); // as a project may have it
    expect(await looks.locator("option:checked").textContent()).toBe("84 starts");
    await looks.selectOption({ label: "as the server decides" });
    expect(await chosen()).toEqual({});
    await user.settled();
    await panel.locator("summary").click();
  });
});

describe("the look", () => {
  it("has wireframe, ghost, normals and a scale that can be pinned", async () => {
    for (const key of ["w", "g"]) {
      const before = await user.colours();
      await press(key);
      await expect.poll(() => user.colours(), { timeout: 10_000 }).not.toEqual(before);
    }
    await press("p");
    const pinned = await user.ask<number>("app.red");
    await user.page.getByRole("button", { name: "6", exact: true }).click();
    await user.settled();
    expect(await user.ask("app.red")).toBe(pinned);
    await press("p");
    expect(await user.ask("app.red")).not.toBe(pinned);
    await user.page.getByRole("button", { name: "Normals" }).click();
    await user.page.locator(".legend").waitFor({ state: "hidden" });
  });

  it.each(["light", "dark"])("can be read when it is %s", async (theme) => {
    await user.ask(`app.view.set({ isDark: ${theme === "dark"} })`);
    const closed = user.page.locator(".panel details:not([open]) > summary");
    while ((await closed.count()) > 0) await closed.first().click();
    // Also what is there at times.
    await user.ask("app.notify('A line.', true)");
    await user.ask("app.facts.set({ problem: { reason: 'X', message: 'a sentence', element: 'vertex 1' }, restoredFrom: 1 })");
    await press("?");
    const faint = await user.page.evaluate(() => {
      const parse = (colour: string) => (colour.match(/[\d.]+/g) ?? []).map(Number);
      const light = ([r, g, b]: number[]) =>
        [r!, g!, b!]
          .map((value) => value / 255)
          .map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
          .reduce((sum, value, k) => sum + value * [0.2126, 0.7152, 0.0722][k]!, 0);
      /** The nearest background that is not to be seen through. */
      const behind = (element: Element | null): number[] => {
        for (let one = element; one; one = one.parentElement) {
          const colour = parse(getComputedStyle(one).backgroundColor);
          if (colour.length === 3 || (colour[3] ?? 0) > 0.9) return colour;
        }
        return [255, 255, 255];
      };
      const found: string[] = [];
      for (const element of document.querySelectorAll("#app *")) {
        const text = [...element.childNodes]
          .filter(({ nodeType }) => nodeType === 3)
          .map(({ textContent }) => textContent!.trim());
        if (text.join("") === "" || !element.checkVisibility() || element.closest(":disabled, option")) continue;
        const [one, other] = [light(parse(getComputedStyle(element).color)), light(behind(element))];
        const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
        if (contrast < 4.5) found.push(`${text.join(" ")}: ${contrast.toFixed(2)}`); // WCAG 2.2, 1.4.3
      }
      for (const track of document.querySelectorAll(".track")) {
        const [one, other] = [light(parse(getComputedStyle(track).backgroundColor)), light(behind(track.parentElement))];
        const contrast = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
        if (contrast < 3) found.push(`the switch ${track.nextElementSibling!.textContent}: ${contrast.toFixed(2)}`); // 1.4.11
      }
      return found;
    });
    expect(faint).toEqual([]);
    await user.page.locator(".banner", { hasText: "A sentence." }).waitFor();
    await press("Escape");
    await user.ask("app.facts.set({ problem: undefined, restoredFrom: undefined })");
  });

  it("is dark and light, and tells its keys", async () => {
    const theme = () => user.page.evaluate("document.documentElement.dataset.theme");
    const before = await theme();
    await press("d");
    expect(await theme()).not.toBe(before);
    await press("?");
    await user.page.getByRole("dialog", { name: "Help" }).waitFor();
    await press("Escape");
    await user.page.getByRole("dialog", { name: "Help" }).waitFor({ state: "hidden" });
    expect(user.errors).toEqual([]);
  });
});
