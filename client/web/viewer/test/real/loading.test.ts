import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { User } from "./user.js";

const dist = join(import.meta.dirname, "../../dist");
/** Names that three.js's classes keep when they are made small. */
const tools = ["isTransformControls", "isLineSegments2", "facet normal"];

it("the first picture needs none of three.js's tools for editing and exporting; they come when they are used", async () => {
  const page = readFileSync(join(dist, "index.html"), "utf8");
  const first = [...page.matchAll(/(?:src|href)="(\/assets\/[^"]+\.js)"/g)].map(([, path]) =>
    readFileSync(dist + path!, "utf8"),
  );
  expect(first.length).toBeGreaterThan(0);
  expect(tools.filter((name) => first.some((code) => code.includes(name)))).toEqual([]);

  const service = await Service.start({ files: dist });
  const user = await User.open(`${service.url}/?shape=bar&detail=coarse`);
  await user.settled();
  await user.ask(`app.facts.set({ pointedOut: { vertices: [], edges: [0, 1], faces: [2] } })`);
  await user.save("Mesh as STL");
  const missing = async () => {
    const loaded = (await user.page.evaluate(() =>
      performance.getEntriesByType("resource").map((entry) => new URL(entry.name).pathname),
    )) as string[];
    const code = loaded.filter((path) => path.endsWith(".js")).map((path) => readFileSync(join(dist, path), "utf8"));
    return tools.filter((name) => !code.some((text) => text.includes(name)));
  };
  await expect.poll(missing, { timeout: 30_000 }).toEqual([]);
  await user.until("window.__lpdeform.app.panes[0].stage.highlight.object.children.length === 2");
  expect(user.errors).toEqual([]);
  await user.close();
  await service.stop();
});
