import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { describe, expect, it } from "vitest";
import type { Service } from "../../../client/test/support/service.js";
import { withService } from "./opened.js";
import { User } from "./user.js";

// What axe finds: contrast, names, roles and order, in both themes and at three sizes, with the panel open and closed.

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
let service: Service;

withService((started) => (service = started));

function checked({ page }: User): Promise<{ found: string[]; passed: string[] }> {
  return page.evaluate(
    `axe.run().then(({ violations, passes }) => ({
      found: violations.flatMap(({ id, nodes }) => nodes.map(({ target }) => id + ": " + target)),
      passed: passes.map(({ id }) => id),
    }))`,
  );
}

it("axe finds nothing in the link to watch live, and on the page that it leads to", async () => {
  const user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Link to watch live" }).click();
  const watcher = await User.open(await user.page.getByLabel("Link", { exact: true }).inputValue());
  await watcher.until("window.__lpdeform?.frame() !== undefined");
  for (const one of [user, watcher]) {
    await one.page.evaluate(axe);
    expect((await checked(one)).found).toEqual([]);
    expect(one.errors).toEqual([]);
    await one.close();
  }
});

describe.each(["light", "dark"] as const)("in the %s theme", (colorScheme) => {
  it.each([
    [1280, 800],
    [390, 844],
    [844, 390],
  ])("axe finds nothing at %dx%d", async (width, height) => {
    const user = await User.open(`${service.url}/?shape=bar&detail=coarse`, { width, height, colorScheme });
    await user.settled();
    await user.page.evaluate(axe);
    for (const isPanelOpen of [false, true]) {
      await user.ask(`app.view.set({ isPanelOpen: ${isPanelOpen}, isSplit: ${isPanelOpen} })`);
      if (isPanelOpen) await user.page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))");
      await user.page.waitForTimeout(300); // until what moves has come to rest
      const { found, passed } = await checked(user);
      expect(found).toEqual([]);
      expect(passed).toEqual(expect.arrayContaining(["color-contrast", "button-name", "label"]));
    }
    expect(user.errors).toEqual([]);
    await user.close();
  });
});
