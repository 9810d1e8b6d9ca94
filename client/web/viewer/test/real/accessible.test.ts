import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

// What axe finds: contrast, names, roles and order, in both themes and at three sizes, with the panel open and closed.

const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
let service: Service;

beforeAll(async () => {
  service = await Service.start({ files: join(import.meta.dirname, "../../dist") });
});

afterAll(() => service.stop());

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
      const { found, passed } = await user.page.evaluate<{ found: string[]; passed: string[] }>(
        `axe.run().then(({ violations, passes }) => ({
          found: violations.flatMap(({ id, nodes }) => nodes.map(({ target }) => id + ": " + target)),
          passed: passes.map(({ id }) => id),
        }))`,
      );
      expect(found).toEqual([]);
      expect(passed).toEqual(expect.arrayContaining(["color-contrast", "button-name", "label"]));
    }
    expect(user.errors).toEqual([]);
    await user.close();
  });
});
