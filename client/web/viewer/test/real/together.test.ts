import { beforeEach, expect, it } from "vitest";
import { withNewUsers } from "./opened.js";
import type { User } from "./user.js";

let user: User;

withNewUsers("/?shape=creature&detail=coarse", (one) => (user = one));

/** The creature has feet, which are locked, a tail, and a head. */
beforeEach(async () => {
  await user.page.locator('[data-handle="Head"] .name').click();
  await user.page.locator("canvas.stage").focus();
});

interface Moved {
  name: string;
  pose: { translation: number[]; rotation: number[]; center: number[] };
}
const handles = async () => new Map((await user.ask<Moved[]>("document().handles")).map((one) => [one.name, one.pose]));
const selection = () => user.ask<unknown[]>("app.view.now.selected + ' ' + window.__lpdeform.app.view.now.alsoSelected");
/** The vertex of the tail that is nearest to the viewer, who looks along y. */
const tailVertex = () =>
  user.page.evaluate<number>(`(() => {
    const { positions } = window.__lpdeform.app.mesh;
    const { vertices } = window.__lpdeform.document().handles.find(({ name }) => name === "Tail");
    return vertices.reduce((best, vertex) => (positions[3 * vertex + 1] < positions[3 * best + 1] ? vertex : best));
  })()`);
const press = (key: string) => user.page.keyboard.press(key);
const together = (name: string) =>
  user.page.getByRole("button", { name: `Move ${name} together with the selected handle (Ctrl+click)` });

it("handles that are selected together are dragged together, in one step, and Escape reverts all of them", async () => {
  await together("Tail").click();
  expect(await selection()).toBe("Head Tail");
  expect(await together("Tail").getAttribute("aria-pressed")).toBe("true");
  const vertex = await tailVertex();
  await press("2");
  await press("1"); // without a gizmo in the way
  const from = await user.vertexOnPage(vertex);
  await user.drag(from, -30, -40);
  const after = await handles();
  expect(Math.hypot(...after.get("Tail")!.translation)).toBeGreaterThan(0.02);
  expect(after.get("Head")!.translation).toEqual(after.get("Tail")!.translation);
  expect(after.get("Feet")!.translation).toEqual([0, 0, 0]);
  expect(await selection()).toBe("Tail Head"); // the one that was taken is the one that the panel shows
  await user.settled();
  await user.page.locator("canvas.stage").focus();
  await press("Control+z");
  expect((await handles()).get("Head")!.translation).toEqual([0, 0, 0]);
  await user.settled(); // else the vertex is not where the mouse comes down

  const { mouse } = user.page;
  const again = await user.vertexOnPage(vertex);
  await mouse.move(again.x, again.y);
  await mouse.down();
  await mouse.move(again.x + 20, again.y - 30, { steps: 4 });
  expect((await handles()).get("Head")!.translation).not.toEqual([0, 0, 0]);
  await press("Escape");
  await mouse.up();
  expect([(await handles()).get("Head")!.translation, (await handles()).get("Tail")!.translation]).toEqual([
    [0, 0, 0],
    [0, 0, 0],
  ]);
  expect(await selection()).toBe("Tail Head");
});

it("Ctrl+A selects all that are not locked; keys turn them as one, delete them as one, and undo brings them back", async () => {
  await press("Control+a");
  expect(await selection()).toBe("Tail Head");
  expect(await user.page.locator(".notice").textContent()).toBe("2 handles are selected: they move together.");
  await press("r");
  await press("ArrowUp");
  const after = await handles();
  expect(after.get("Head")!.rotation).toEqual(after.get("Tail")!.rotation);
  expect(Math.hypot(...after.get("Head")!.translation)).toBeGreaterThan(0.01); // about the tail's middle
  await press("Control+z");
  await press("Delete");
  expect([...(await handles()).keys()]).toEqual(["Feet"]);
  await press("Control+z");
  expect([...(await handles()).keys()]).toEqual(["Feet", "Tail", "Head"]);
  expect(await selection()).toBe("Tail Head");
});

it("Ctrl and a click on a handle select it, too, and a click without Ctrl selects one alone", async () => {
  const vertex = await tailVertex();
  const { x, y } = await user.vertexOnPage(vertex);
  await user.page.keyboard.down("Control");
  await user.page.mouse.click(x, y);
  await user.page.keyboard.up("Control");
  expect(await selection()).toBe("Head Tail");
  await user.page.locator('[data-handle="Feet"] .name').click();
  expect(await selection()).toBe("Feet ");
});

it("Tab reaches what selects a handle, too, and goes on over its name without leaving the others", async () => {
  await user.page.locator('[data-handle="Tail"] .name').focus();
  const label = () => user.page.evaluate("document.activeElement.getAttribute('aria-label')");
  const wanted = "Move Head together with the selected handle (Ctrl+click)";
  for (let k = 0; k < 8 && (await label()) !== wanted; ++k) await press("Tab");
  expect(await label()).toBe(wanted);
  await press("Enter");
  expect(await selection()).toBe("Tail Head");
  await press("Tab");
  expect(await label()).toBe("Name");
  expect(await selection()).toBe("Head Tail");
  await user.page.locator("canvas.stage").focus();
  await press("Escape");
  await user.page.locator('[data-handle="Head"] .name').focus();
  await press("Shift+Tab");
  expect(await label()).toBe(wanted);
  await press("Enter"); // the only one that is selected stays so
  expect(await selection()).toBe("Head ");
});

it("numbers move, turn and scale all that are selected, each entry in one step", async () => {
  await together("Tail").click();
  const before = await handles();
  const enter = async (name: string, text: string) => {
    const field = user.page.getByRole("textbox", { name, exact: true });
    await field.fill(text);
    await field.press("Enter");
  };
  await enter("Moved along x", "0.25");
  const moved = await handles();
  expect([moved.get("Head")!.translation, moved.get("Tail")!.translation]).toEqual([
    [0.25, 0, 0],
    [0.25, 0, 0],
  ]);
  await enter("Turned about z", "90");
  const turned = await handles();
  expect(turned.get("Tail")!.rotation).toEqual(turned.get("Head")!.rotation);
  expect(turned.get("Head")!.translation).toEqual([0.25, 0, 0]);
  expect(turned.get("Tail")!.translation).not.toEqual([0.25, 0, 0]); // about the head's middle
  await enter("Scaled along x", "1.5");
  expect(await user.ask("document().handles.map(({ pose }) => pose.scale !== undefined)")).toEqual([false, true, true]);
  await user.page.locator("canvas.stage").focus();
  for (let k = 0; k < 3; ++k) await press("Control+z");
  expect(await handles()).toEqual(before);
});

it("a drag does not keep to the vertices of handles that move along with it", async () => {
  await together("Tail").click();
  await user.page.getByLabel("What a drag keeps to").selectOption("vertices");
  await user.page.locator("canvas.stage").focus();
  await press("1");
  const vertex = await tailVertex();
  const vertices = await user.page.evaluate<number[]>(
    `window.__lpdeform.document().handles.flatMap(({ name, vertices }) => (name === "Head" ? vertices : []))`,
  );
  const places = await Promise.all(vertices.map((one) => user.vertexOnPage(one)));
  const from = await user.vertexOnPage(vertex);
  const to = places[0]!;
  await user.drag(from, to.x - from.x, to.y - from.y);
  const rest = await user.ask<Record<string, number>>("app.mesh.positions");
  const { translation } = (await handles()).get("Tail")!;
  const goal = [0, 1, 2].map((axis) => rest[3 * vertex + axis]! + translation[axis]!);
  const far = vertices.map((one) => Math.hypot(...goal.map((value, axis) => value - rest[3 * one + axis]!)));
  expect(Math.min(...far)).toBeGreaterThan(1e-3); // frames of 16 bits
});
