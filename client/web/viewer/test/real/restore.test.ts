import { join } from "node:path";
import type { BrowserContext } from "playwright-core";
import { afterAll, afterEach, beforeAll, beforeEach, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { writeOff } from "../../src/io/write_off.js";
import { blockSurface } from "../../src/model/block.js";
import { User } from "./user.js";

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(() => service.stop());

beforeEach(async () => {
  user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
});

afterEach(async () => {
  expect(user.errors).toEqual([]);
  await user.close();
});

const note = () => user.page.locator(".restored");
const reload = async () => {
  await user.page.reload();
  await user.settled();
};
/** All that undo brings back, as text. */
const work = () =>
  user.page.evaluate<string>(
    "JSON.stringify(__lpdeform.document(), (_, value) => (value instanceof Float32Array ? [...value].map(String) : value))",
  );

async function bend(): Promise<void> {
  const vertex = await user.ask<number>("document().handles[1].vertices[0]");
  await user.drag(await user.vertexOnPage(vertex), 110, 50);
  await user.settled();
}

async function openTower(name: string): Promise<void> {
  await user.openFiles({ name, content: writeOff(blockSurface(2, 2, 6, () => true)) });
  await user.until(`window.__lpdeform.app.mesh.name === '${name}' && window.__lpdeform.app.facts.now.report`);
  const { x, y } = await user.vertexOnPage(await user.vertexNear([1, 0, 5]));
  await user.page.mouse.click(x, y);
}

const far = (a: readonly number[], b: readonly number[]) => Math.max(...a.map((value, k) => Math.abs(value - b[k]!)));

it("a reload brings handles, groups, p, painting, both panes and the view back, and says so", async () => {
  await bend();
  const row = user.page.locator(".handles li").nth(1);
  await row.getByLabel("Name").fill("Pulled");
  await row.getByLabel("Name").press("Enter");
  await user.page.keyboard.press("5");
  const [from, to] = [
    await user.vertexOnPage(await user.vertexNear([0.5, 0, 1])),
    await user.vertexOnPage(await user.vertexNear([0.5, 0, 2])),
  ];
  await user.drag(from, to.x - from.x, to.y - from.y);
  await user.page.locator("canvas.stage").focus();
  for (const key of ["1", "w", "c", "s"]) await user.page.keyboard.press(key);
  await user.settled(1);
  await user.page.getByRole("button", { name: "2", exact: true }).first().click();
  await user.page.locator("canvas.stage").first().focus();
  await user.page.mouse.move(150, 600);
  await user.page.mouse.wheel(0, -300);
  await user.settled(0);
  await user.settled(1);
  const look = () =>
    user
      .ask<object>(`app.panes.map(({ stage }) => stage.look)`)
      .then((looks) =>
        JSON.parse(JSON.stringify(looks), (_, value) => (typeof value === "number" ? Number(value.toFixed(6)) : value)),
      );
  const view = () => user.ask<object>("app.view.now");
  const before = [await work(), await look(), await view()];
  const positions = [await user.positions(0), await user.positions(1)];

  await reload(); // at once: what the last moment changed is kept as well
  await user.settled(1);
  expect([await work(), await look(), await view()]).toEqual(before);
  for (const pane of [0, 1]) expect(far(await user.positions(pane), positions[pane]!)).toBeLessThan(0.02);
  expect(await note().textContent()).toContain("“bar” is here again as you left it just now.");

  await user.page.getByRole("button", { name: "6", exact: true }).first().click(); // whoever goes on knows
  expect(await note().isHidden()).toBe(true);
});

it("what was done before a reload is undone after it, and done again", async () => {
  const states = [await work()];
  await bend();
  states.push(await work());
  await user.page.getByRole("button", { name: "6", exact: true }).first().click();
  states.push(await work());
  await user.page.keyboard.press("Control+z");
  await reload();
  expect(await work()).toEqual(states[1]);
  await user.page.keyboard.press("Control+Shift+z");
  expect(await work()).toEqual(states[2]);
  for (const state of [states[1], states[0]]) {
    await user.page.keyboard.press("Control+z");
    expect(await work()).toEqual(state);
  }
  expect(await user.ask("app.history.canUndo")).toBe(false);
  await user.settled();
});

it("a mesh from a file comes back, and is deleted on demand, for good", async () => {
  const tower = blockSurface(2, 2, 6, () => true);
  await user.openFiles({ name: "tower.off", content: writeOff(tower) });
  await user.until("window.__lpdeform.app.facts.now.report && window.__lpdeform.app.mesh.name === 'tower.off'");
  const place = await user.vertexOnPage(await user.vertexNear([1, 0, 5]));
  await user.page.mouse.click(place.x, place.y);
  await user.settled();
  await reload();
  expect(await user.ask("app.mesh.name")).toBe("tower.off");
  expect(Object.values(await user.ask<object>("app.mesh.positions"))).toEqual([...tower.positions]);
  expect(Object.values(await user.ask<object>("app.mesh.faces"))).toEqual([...tower.faces]);
  expect(await user.ask("document().handles.length")).toBe(1);

  await user.page.getByRole("button", { name: "Discard it" }).click();
  await user.settled();
  expect(await user.ask("app.mesh.name")).toBe("bar");
  expect(await note().isHidden()).toBe(true);
  await user.page.waitForTimeout(700);
  await reload();
  expect(await user.ask("app.mesh.name")).toBe("bar");
  expect(await note().isHidden()).toBe(true);
});

it("a mesh from a file comes back however soon the page is reloaded, beside work that it replaced", async () => {
  const names = ["soon.off", "sooner.off"];
  await bend();
  for (const name of names) {
    await user.openFiles({ name, content: writeOff(blockSurface(2, 2, 6, () => true)) });
    await user.until(`window.__lpdeform.app.mesh.name === '${name}'`);
    await reload();
    expect(await user.ask("app.mesh.name")).toBe(name);
  }
  expect(await user.ask("app.facts.now.setAside.map(({ name }) => name)")).toEqual([names[0], "bar"]);
});

it("work that another shape or a file replaced, or that was discarded, is brought back", async () => {
  await bend();
  const bent = await work();
  const aside = user.page.locator(".aside");
  const bringBack = async () => {
    expect(await aside.textContent()).toContain("“bar” was set aside");
    await aside.getByRole("button", { name: "Bring it back" }).click();
    await user.settled();
    expect([await work(), await user.ask("app.mesh.name"), await user.ask("app.view.now.shape")]).toEqual([bent, "bar", "bar"]);
    expect(await aside.isHidden()).toBe(true);
  };
  await user.page.getByLabel("Shape").selectOption("sheet");
  await user.settled();
  await bringBack();
  expect(await user.ask("app.history.canUndo")).toBe(true);

  await user.openFiles({ name: "tower.off", content: writeOff(blockSurface(2, 2, 6, () => true)) });
  await user.until("window.__lpdeform.app.mesh.name === 'tower.off'");
  await bringBack();

  await user.page.waitForTimeout(700);
  await reload();
  await user.page.getByRole("button", { name: "Discard it" }).click();
  await user.settled();
  await bringBack();
  await user.page.waitForTimeout(700);
  await reload(); // kept again
  expect(await work()).toBe(bent);

  await user.page.getByRole("button", { name: "Go on" }).click();
  await user.page.getByLabel("Shape").selectOption("sheet");
  await user.settled();
  await bringBack();
  await user.page.getByLabel("Shape").selectOption("sheet");
  await aside.getByRole("button", { name: "Dismiss" }).click();
  await user.page.getByLabel("Shape").selectOption("bar"); // nothing was done to the sheet
  await user.settled();
  expect(await aside.isHidden()).toBe(true);
});

it("the note that work was set aside goes when one goes on, and the hint what to do next stands beside it", async () => {
  await bend();
  await user.openFiles({ name: "tower.off", content: writeOff(blockSurface(2, 2, 6, () => true)) });
  const aside = user.page.locator(".aside", { hasText: "“bar” was set aside with your work on it." });
  await aside.waitFor();
  await user.page.locator(".hint", { hasText: "Click the surface to place a first handle" }).waitFor();
  await user.settled();
  const { width } = (await aside.boundingBox())!;
  const { x, y } = await user.vertexOnPage(await user.vertexNear([1, 0, 5]));
  await user.page.mouse.click(x, y);
  expect(await user.ask("document().handles.length")).toBe(1);
  expect((await aside.boundingBox())!.width).toBeLessThan(0.6 * width);
  await aside.getByRole("button", { name: "Bring it back" }).click();
  await user.until("window.__lpdeform.app.mesh.name === 'bar'");
  await user.page.locator(".aside", { hasText: "“tower.off” was set aside" }).getByText("was set aside").waitFor();
});

it("work that was set aside stays, however much is opened after it and left as it was, over a reload too", async () => {
  await bend();
  const bent = await work();
  const aside = user.page.locator(".aside");
  const tower = { name: "tower.off", content: writeOff(blockSurface(2, 2, 6, () => true)) };
  const openOthers = async () => {
    await user.page.getByLabel("Shape").selectOption("sheet");
    await user.openFiles(tower);
    await user.until("window.__lpdeform.app.mesh.name === 'tower.off'");
    await user.page.getByLabel("Shape").selectOption("block");
    await user.settled();
    expect(await aside.textContent()).toContain("“bar” was set aside");
  };
  await openOthers();
  await aside.getByRole("button", { name: "Bring it back" }).click();
  await user.settled();
  expect(await work()).toBe(bent);
  expect(await aside.isHidden()).toBe(true);

  await openOthers();
  await user.page.waitForTimeout(700);
  await reload();
  expect([await work(), await user.ask("app.mesh.name"), await user.ask("app.view.now.shape")]).toEqual([bent, "bar", "bar"]);
  expect(await note().textContent()).toContain("“bar” is here again");

  await user.openFiles(tower); // the mesh of a file is there again, and so is the work
  await user.until("window.__lpdeform.app.mesh.name === 'tower.off'");
  await reload();
  expect(await user.ask("app.mesh.name")).toBe("tower.off");
  await aside.getByRole("button", { name: "Bring it back" }).click();
  await user.settled();
  expect(await work()).toBe(bent);
});

it("each work that is followed by another stays, however many there are, over a reload too", async () => {
  await bend();
  const works = [await work()];
  for (const name of ["second.off", "third.off"]) {
    await openTower(name);
    works.push(await work());
  }
  const aside = user.page.locator(".aside");
  const names = () => aside.locator("option").allTextContents();
  const expectThird = async () => {
    expect([await user.ask("app.mesh.name"), await work()]).toEqual(["third.off", works[2]]);
    expect(await names()).toEqual(["second.off", "bar"]);
    expect(await aside.textContent()).toContain("2 were set aside with your work:");
  };
  await expectThird();
  await user.page.waitForTimeout(700);
  await user.page.reload();
  await user.until("window.__lpdeform?.status() === 'live'");
  await expectThird();

  const bringBack = async (name: string) => {
    await aside.getByLabel("Work that was set aside").selectOption(name);
    await aside.getByRole("button", { name: "Bring it back" }).click();
    await user.until(`window.__lpdeform.app.mesh.name === '${name}'`);
    return work();
  };
  expect(await bringBack("bar")).toBe(works[0]);
  expect(await names()).toEqual(["third.off", "second.off"]);
  expect(await bringBack("second.off")).toBe(works[1]);
  expect(await names()).toEqual(["bar", "third.off"]);
  await aside.getByRole("button", { name: "Dismiss" }).click();
  expect(await names()).toEqual(["third.off"]);
  expect(await aside.textContent()).toContain("“third.off” was set aside with your work on it.");
  await user.page.waitForTimeout(700);
  await user.page.reload();
  await user.until("window.__lpdeform?.status() === 'live'");
  expect([await user.ask("app.mesh.name"), await names()]).toEqual(["second.off", ["third.off"]]);
  const keys = await user.page.evaluate(`new Promise((resolve) => {
    indexedDB.open("lpdeform").onsuccess = ({ target }) => {
      const meshes = target.result.transaction("meshes").objectStore("meshes");
      meshes.getAllKeys().onsuccess = ({ target: { result } }) => resolve(result.length);
    };
  })`);
  expect(keys).toBe(2); // what was dismissed takes no room
});

it("work that was set aside and cannot be read any more takes nothing else with it", async () => {
  await bend();
  for (const name of ["second.off", "third.off"]) await openTower(name);
  const last = await work();
  await user.page.waitForTimeout(700);
  await user.page.evaluate(`new Promise((resolve) => {
    indexedDB.open("lpdeform").onsuccess = ({ target: { result } }) => {
      const transaction = result.transaction(["works", "meshes"], "readwrite");
      transaction.oncomplete = resolve;
      transaction.objectStore("works").get(sessionStorage.getItem("lpdeform-work")).onsuccess = ({ target }) => {
        const [{ meshKey }] = target.result.asides;
        const arrays = [{ key: "positions", kind: "Float32Array", length: 3 }];
        transaction.objectStore("meshes").put({ arrays, blob: new Blob(["gone"]), rest: { name: "second.off" } }, meshKey);
      };
    };
  })`);
  await user.page.reload();
  await user.until("window.__lpdeform?.status() === 'live'");
  expect([await user.ask("app.mesh.name"), await work()]).toEqual(["third.off", last]);
  expect(await user.ask("app.facts.now.setAside.map(({ name }) => name)")).toEqual(["bar"]);
});

it("work at which the page stopped is shown again only where that is wanted", async () => {
  await bend();
  const bent = await work();
  await reload();
  await reload(); // a page that was left in good order
  expect(await work()).toBe(bent);

  // What a page leaves behind that does not survive its first picture.
  const stop = () =>
    user.page.evaluate("localStorage.setItem('lpdeform-restoring-' + sessionStorage.getItem('lpdeform-work'), 'yes')");
  const question = user.page.getByRole("dialog", { name: "Your work" });
  await stop();
  await user.page.reload();
  await question.getByText("Show “bar” again?").waitFor();
  expect(await user.ask("app.mesh.name")).toBe("");
  await question.getByRole("button", { name: "Show it again" }).click();
  await user.settled();
  expect(await work()).toBe(bent);
  expect(await question.isVisible()).toBe(false);

  await stop();
  for (const putOff of [() => user.page.keyboard.press("Escape"), () => question.getByText("Not now").click()]) {
    await user.page.reload();
    await question.waitFor();
    await putOff();
    await user.settled();
    expect(await user.ask("app.history.canUndo")).toBe(false);
    expect(await work()).not.toBe(bent);
    await user.page.waitForTimeout(700);
  }
  await user.page.reload(); // it is there yet
  await question.getByRole("button", { name: "Show it again" }).click();
  await user.settled();
  expect(await work()).toBe(bent);

  // Put off, and other work in its place: then it is a new tab's to ask, and again the next one's.
  await stop();
  await user.page.reload();
  await question.getByText("Not now").click();
  await user.settled();
  await user.page.locator(".dock").getByRole("button", { name: "6", exact: true }).click();
  await reload(); // at once; it drops what was put off
  expect(await note().textContent()).toContain("is here again");
  const [asked, context, address] = [await work(), user.page.context(), user.page.url()];
  expect(asked).not.toBe(bent);
  for (const answer of ["Not now", "Show it again"]) {
    const page = await context.newPage();
    await page.goto(address);
    await page.getByRole("dialog", { name: "Your work" }).getByRole("button", { name: answer }).click();
    await page.waitForFunction("window.__lpdeform?.status() === 'live'");
    const isBack = (await page.evaluate("JSON.stringify(window.__lpdeform.document())")) === bent;
    expect(isBack).toBe(answer === "Show it again");
    await page.close();
  }

  await stop();
  await user.page.reload();
  await question.getByRole("button", { name: "Discard it" }).click();
  await user.settled();
  expect(await user.ask("app.history.canUndo")).toBe(false);
  expect(await work()).not.toBe(bent);
  await reload();
  expect(await note().isHidden()).toBe(true);
});

it("what was not worked on is not kept", async () => {
  await user.page.waitForTimeout(700);
  await reload();
  expect(await note().isHidden()).toBe(true);
});

it("a new tab leaves the work of an open one alone, and has that of a closed one", async () => {
  await bend();
  const before = await work();
  const context: BrowserContext = user.page.context();
  const address = user.page.url();
  const visit = async () => {
    const page = await context.newPage();
    await page.goto(address);
    await page.waitForFunction("window.__lpdeform?.status() === 'live'");
    return page;
  };
  await user.page.waitForTimeout(700);
  const second = await visit();
  expect(await second.locator(".restored").isHidden()).toBe(true);
  expect(await second.evaluate("window.__lpdeform.app.history.canUndo")).toBe(false);
  await second.close();

  await user.page.close();
  const third = await visit();
  await third.locator(".restored").waitFor();
  expect(await third.evaluate("JSON.stringify(window.__lpdeform.document())")).toBe(before);
});

it("what is old is deleted, but not the work of an open tab", async () => {
  await bend();
  await user.page.waitForTimeout(700);
  // The open tab's and a closed one's, both of long ago.
  const kept = (then: string) =>
    user.page.evaluate<string[]>(`new Promise((resolve) => {
      indexedDB.open("lpdeform").onsuccess = ({ target }) => {
        const transaction = target.result.transaction("works", "readwrite");
        const works = transaction.objectStore("works");
        works.getAll().onsuccess = ({ target: { result } }) => (${then})(works, result);
        works.getAllKeys().onsuccess = ({ target: { result } }) => resolve(result);
      };
    })`);
  const [own] = await kept("() => undefined");
  await kept(`(works, [own]) => {
    works.put({ ...own, savedAt: 0 });
    works.put({ ...own, savedAt: 0, id: "closed", address: "?shape=sheet" });
  }`);
  expect(await kept("() => undefined")).toEqual([own, "closed"].sort());
  const second = await user.page.context().newPage();
  await second.goto(user.page.url());
  await second.waitForFunction("window.__lpdeform?.status() === 'live'");
  await second.waitForTimeout(300);
  expect(await kept("() => undefined")).toEqual([own]);
  await second.close();
  const before = await work();
  await reload();
  expect(await work()).toBe(before);
});

it("a page that holds the kept work does not keep a newer page from renewing the database", async () => {
  expect(
    await user.page.evaluate(`new Promise((resolve) => {
      const request = indexedDB.deleteDatabase("lpdeform");
      request.onsuccess = () => resolve("renewed");
      request.onblocked = () => resolve("blocked");
    })`),
  ).toBe("renewed");
});

it("a browser that keeps nothing asks before the page is left", async () => {
  const context = await user.browser.newContext({ viewport: { width: 1280, height: 800 }, bypassCSP: true });
  await context.addInitScript(() => {
    IDBFactory.prototype.open = () => {
      throw new DOMException("forbidden", "SecurityError");
    };
  });
  const page = await context.newPage();
  await page.goto(user.page.url());
  await page.waitForFunction("window.__lpdeform?.frame()?.isFinal");
  const asked: string[] = [];
  page.on("dialog", (dialog) => {
    asked.push(dialog.type());
    void dialog.accept();
  });
  await page.reload();
  await page.waitForFunction("window.__lpdeform?.frame()?.isFinal");
  expect(asked).toEqual([]);
  await page.locator(".dock").getByRole("button", { name: "6", exact: true }).click();
  await page.reload();
  expect(asked).toEqual(["beforeunload"]);
});

it("a browser that lets the page remember nothing shows it all the same", async () => {
  const context = await user.browser.newContext({ viewport: { width: 1280, height: 800 }, bypassCSP: true });
  await context.addInitScript(() => {
    for (const storage of ["localStorage", "sessionStorage"] as const) {
      Object.defineProperty(window, storage, {
        get() {
          throw new DOMException("Access is denied for this document.", "SecurityError");
        },
      });
    }
  });
  const page = await context.newPage();
  const errors: string[] = [];
  page.on("pageerror", ({ message }) => errors.push(message));
  await page.goto(user.page.url());
  await page.waitForFunction("window.__lpdeform?.frame()?.isFinal");
  const theme = () => page.evaluate<string>("document.documentElement.dataset.theme");
  const before = await theme();
  await page.evaluate("__lpdeform.app.view.set({ isDark: !__lpdeform.app.view.now.isDark })");
  expect([before, await theme()]).toEqual(["light", "dark"]);
  await page.emulateMedia({ colorScheme: "dark" });
  expect(errors).toEqual([]);
});
