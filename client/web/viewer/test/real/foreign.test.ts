import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type Page } from "playwright-core";
import { build } from "vite";
import { afterAll, beforeAll, describe, expect, it } from "vitest";
import { Service } from "../../../client/test/support/service.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { faultsOf } from "../gltf_validator.js";
import { columns, make3mf, makeBinaryFbx, makeDae, makeFbx, makeOddDae } from "../made_foreign.js";
import { User } from "./user.js";

const dist = join(import.meta.dirname, "../../dist");
const files = {
  "tube.dae": Buffer.from(makeDae()),
  "odd.dae": Buffer.from(makeOddDae()),
  "tube.fbx": Buffer.from(makeFbx()),
  "tube.3mf": Buffer.from(make3mf()),
};

let service: Service;
let user: User;

beforeAll(async () => {
  service = await Service.start({ files: dist });
  user = await User.open(`${service.url}/?shape=bar&detail=coarse&encoding=float32`);
  await user.settled();
});

afterAll(async () => {
  await user.close();
  await service.stop();
});

const notice = (words: string) => user.page.locator(".notice", { hasText: words }).first().waitFor({ timeout: 15_000 });
/** Takes away what the page said before. */
const forgetNotice = () => user.page.evaluate("window.__lpdeform.app.facts.set({ notice: undefined })");

describe("the viewer", () => {
  it("loads the readers of other formats with the first such file, and not before, in a worker", async () => {
    const own = () =>
      user.page.evaluate(() =>
        performance
          .getEntriesByType("resource")
          .map(({ name }) => name)
          .join(),
      );
    const asked: string[] = [];
    user.page.on("request", (request) => asked.push(request.url()));
    expect(await own()).not.toMatch(/foreign|FBX|Collada|3MF/);
    await user.openFiles({ name: "tube.fbx", content: files["tube.fbx"] });
    await notice("tube.fbx is opened as tube.glb.");
    expect(asked.join()).toMatch(/foreign_worker.*FBXLoader/);
    expect(asked.join()).not.toMatch(/Collada|3MFLoader/);
    expect(await own()).not.toMatch(/foreign_glb|FBX/);
  });

  it.each(["tube.dae", "tube.fbx", "tube.3mf"] as const)(
    "opens %s upright and where it stands, bends it, and saves it as a GLB",
    async (name) => {
      await user.openFiles({ name, content: files[name] });
      await notice(`${name} is opened as tube.glb.`);
      await notice("Shown with y up");
      await user.settled();
      const positions = await user.positions();
      const heights = positions.filter((_, k) => k % 3 === 1);
      expect(Math.min(...heights)).toBeCloseTo(5, 4);
      expect(Math.max(...heights)).toBeCloseTo(13, 4);
      const where = (height: number) => heights.flatMap((y, v) => (Math.abs(y - height) < 1e-4 ? [v] : []));
      const handles = [
        { name: "base", vertices: where(5) },
        { name: "tip", vertices: where(13), translate: [2, 0, 0] },
      ];
      await user.openFiles({ name: "tube.json", content: JSON.stringify({ handles }) });
      await user.handlesCame("tip");
      const saved = new Uint8Array(await user.save("Mesh as GLB"));
      expect(await faultsOf(saved)).toEqual([]);
      const bent = parseMesh("a.glb", saved);
      const top = where(13).map((v) => bent.positions[3 * v]!);
      expect((Math.min(...top) + Math.max(...top)) / 2).toBeCloseTo(2, 3);
      expect(new Set(where(13).map((v) => bent.positions.subarray(3 * v, 3 * v + 3).join())).size).toBe(columns);
      expect(new TextDecoder().decode(saved)).toContain('"pipe"');
      expect(user.errors).toEqual([]);
    },
  );

  it("opens strips, fans and polygons, with prefixes and a DOCTYPE, and loads nothing that this names", async () => {
    const asked: string[] = [];
    user.page.on("request", (request) => asked.push(request.url()));
    await user.openFiles({ name: "odd.dae", content: files["odd.dae"] });
    await notice("odd.dae is opened as odd.glb.");
    await user.settled();
    const heights = (await user.positions()).filter((_, k) => k % 3 === 1);
    expect([Math.min(...heights), Math.max(...heights)].map((y) => y.toFixed(4))).toEqual(["5.0000", "13.0000"]);
    expect(await user.ask<number>("app.mesh.faces.length")).toBe(3 * 384);
    expect(asked.filter((url) => url.includes("dtd"))).toEqual([]);
    expect(user.errors).toEqual([]);
  });

  it("opens nodes that lie as deep in each other as a file may have them", async () => {
    const dae = makeDae()
      .replace("<node ", `${"<node>".repeat(490)}<node `)
      .replace("</node>", "</node>".repeat(491));
    await user.openFiles({ name: "deep.dae", content: Buffer.from(dae) });
    await notice("deep.dae is opened as deep.glb.");
  });

  it("loads nothing that a file names, and says what is left out", async () => {
    const asked: string[] = [];
    user.page.on("request", (request) => asked.push(request.url()));
    await forgetNotice();
    await user.openFiles({ name: "tube.dae", content: files["tube.dae"] });
    await notice("Left out: textures.");
    expect(asked.filter((url) => url.includes("example") || url.includes("a.png"))).toEqual([]);
  });

  it.each([
    ["a.fbx", "", "a.fbx is empty."],
    [
      "a.fbx",
      "; FBX 6.1.0 project file\nFBXVersion: 6100\n",
      "a.fbx cannot be read as FBX: FBX version not supported, FileVersion: 6100.",
    ],
    ["a.dae", "<COLLADA", "a.dae ends too soon: the tag of line 1 has no end."],
    [
      "a.dae",
      '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"></COLLADA>',
      "a.dae, line 1: <COLLADA> has no <asset>.",
    ],
    [
      "a.dae",
      '<!DOCTYPE a [<!ENTITY b "c">]><COLLADA/>',
      "a.dae, line 1: the DOCTYPE declares an entity (<!ENTITY), which this page does not read.",
    ],
    ["a.3mf", "PK", "a.3mf cannot be read as 3MF"],
    ["a.3mf", Buffer.from(make3mf(501e6)), "a.3mf cannot be read as 3MF: unpacked it has 501"],
    ["a.fbx", makeBinaryFbx(7400, 63e6), "a.fbx cannot be read as FBX: unpacked it has 50"],
    ["a.fbx", makeBinaryFbx(7500, 63e6), "a.fbx cannot be read as FBX: unpacked it has 50"],
    ["a.fbx", makeBinaryFbx(7400, 30e6, 33e6), "a.fbx cannot be read as FBX: unpacked it has 50"], // each is allowed by itself
  ])("refuses %s with a sentence", async (name, content, words) => {
    await forgetNotice(); // several have the same words
    await user.openFiles({ name, content });
    await notice(words);
    expect(user.errors).toEqual([]);
  });
});

describe("hostile files", () => {
  let folder: string;
  let bare: Service;
  let page: Page;

  beforeAll(async () => {
    folder = mkdtempSync(join(tmpdir(), "lpdeform-foreign-"));
    const root = join(import.meta.dirname, "foreign_page");
    await build({
      root,
      base: "./",
      logLevel: "error",
      configFile: false,
      worker: { format: "es" },
      build: { outDir: folder, target: "es2022" },
    });
    bare = await Service.start({ files: folder });
    page = await (await user.browser.newContext({ bypassCSP: true })).newPage();
    await page.goto(bare.url);
    await page.waitForFunction(() => window.mutate);
  });

  afterAll(async () => {
    await bare.stop();
    rmSync(folder, { recursive: true });
  });

  it("leave the page its console, also if two are read at once", async () => {
    const isHeard = await page.evaluate(
      async (dae) => {
        const { log } = console;
        await Promise.all([window.convert("a.dae", dae), window.convert("b.dae", dae)]);
        return console.log === log;
      },
      [...files["tube.dae"]],
    );
    expect(isHeard).toBe(true);
  });

  it("of 3MF are read by the page if their XML takes more than a worker has", async () => {
    const loaded = () =>
      page.evaluate(() => performance.getEntriesByType("resource").some(({ name }) => /3MFLoader/.test(name)));
    expect(await page.evaluate((bytes) => window.convert("a.3mf", bytes), [...files["tube.3mf"]])).toMatch(/vertices$/);
    expect(await loaded()).toBe(false);
    expect(await page.evaluate((bytes) => window.convert("a.3mf", bytes), [...make3mf(32.1e6)])).toMatch(/vertices$/);
    expect(await loaded()).toBe(true);
  });

  it("are read by the page if it can have no workers", async () => {
    const other = await page.context().newPage();
    await other.addInitScript("delete window.Worker");
    await other.goto(bare.url);
    await other.waitForFunction(() => window.convert);
    for (const [name, content] of Object.entries(files)) {
      expect(await other.evaluate(([name, bytes]) => window.convert(name, bytes), [name, [...content]] as const)).toMatch(
        /vertices$/,
      );
    }
    await other.close();
  });

  it("are read or refused by a sentence about the file, however they are damaged", async () => {
    for (const [name, content] of Object.entries(files)) {
      expect(await page.evaluate(([name, bytes]) => window.convert(name, bytes), [name, [...content]] as const)).toMatch(
        /vertices$/,
      );
      const { read, refused } = await page.evaluate(([name, bytes]) => window.mutate(name, bytes, 7, 150), [
        name,
        [...content],
      ] as const);
      console.log(`${name}: of 150 damaged copies ${read} were read and ${refused} refused`);
      expect(refused).toBeGreaterThan(0);
      expect(read + refused).toBe(150);
    }
  });
});
