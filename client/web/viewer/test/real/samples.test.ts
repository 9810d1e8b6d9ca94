import { execFile } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { afterAll, expect, it } from "vitest";
import { root } from "../../../client/test/support/service.js";
import { readGltfDocument } from "lpdeform-client/mesh/gltf_document";
import { parseMesh } from "lpdeform-client/mesh/read";
import { lostIn } from "../gltf_kept.js";
import { faultsOf } from "../gltf_validator.js";
import { pathOf, samplesOf } from "../samples.js";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

// Files that nobody made for this page: those of Debian's package assimp-testmodels.

let user: User;

withUser(bar, (one) => (user = one));

const folder = mkdtempSync(join(tmpdir(), "lpdeform-samples-"));
afterAll(() => rmSync(folder, { recursive: true }));

const samples = samplesOf(/\.(glb|gltf|off|obj|ply|stl|fbx|dae|3mf)$/i);
const isModel = (name: string) => /\.(glb|gltf|off|obj|ply|stl|fbx|dae|3mf|json)$/i.test(name);

it("each that is dropped onto the page is opened and taken by the server, or refused by name, and then nothing has changed", async () => {
  let opened = 0;
  for (const { path, name, beside } of samples) {
    await user.page.evaluate(`(() => {
      const { app } = window.__lpdeform;
      app.facts.set({ notice: undefined });
      window.before = [app.mesh, app.document];
    })()`);
    const others = /\.(gltf|obj)$/i.test(name) ? [...beside.keys()].filter((other) => !isModel(other)) : [];
    await user.drop(pathOf(path), ...others.map((other) => pathOf(join(path, "..", other))));
    await user.until(
      "(({ notice }) => notice && !notice.stays && !/overloaded/.test(notice.text))(window.__lpdeform.app.facts.now)",
    );
    const { text, isBad } = await user.ask<{ text: string; isBad: boolean }>("app.facts.now.notice");
    const isKept = await user.page.evaluate<boolean>(
      "(({ mesh, document }) => window.before[0] === mesh && window.before[1] === document)(window.__lpdeform.app)",
    );
    expect([path, isKept]).toEqual([path, isBad]);
    if (isBad) expect(text).toMatch(/^(\S+\.\w+|[A-Z“])[^\n]* [^\n]*\.$/u);
    else {
      ++opened;
      await user.until("(({ status, report }) => status.kind === 'live' && report)(window.__lpdeform.app.facts.now)");
    }
    expect(user.errors.map((error) => `${path}: ${error}`)).toEqual([]);
  }
  expect(opened).toBeGreaterThan(samples.length / 2);
}, 300_000);

it("the command line gives every glTF that it reads back with everything but positions, normals and tangents as it came", async () => {
  let kept = 0;
  for (const { path, name, bytes, beside } of samples.filter((one) => /\.(glb|gltf)$/i.test(one.name))) {
    let mesh;
    try {
      mesh = parseMesh(name, bytes, beside);
    } catch {
      continue; // which the page refuses; see above
    }
    const [first, last] = [mesh.faces[0]!, mesh.faces.at(-1)!];
    const handles = [
      { name: "one", vertices: [first] },
      { name: "other", vertices: [last], translate: [0.1, 0.2, 0.3] },
    ];
    writeFileSync(join(folder, "handles.json"), JSON.stringify({ handles }));
    const out = join(folder, "out.glb");
    const options = ["--handles", join(folder, "handles.json"), "--free-components", "stay", "--normals", "--out", out];
    await promisify(execFile)(join(root, "build/release/bin/lpdeform"), ["deform", pathOf(path), ...options]);
    const bent = new Uint8Array(readFileSync(out));
    const buffers = new Map([...beside].filter(([other]) => !/\.(png|jpe?g)$/i.test(other)));
    const [before, after] = [readGltfDocument(name, bytes, buffers), readGltfDocument("a.glb", bent.slice(), new Map())];
    expect([path, lostIn(before, after, beside)]).toEqual([path, []]);
    if ((await faultsOf(mesh.gltf!)).length === 0) expect([path, await faultsOf(bent)]).toEqual([path, []]);
    const again = parseMesh("a.glb", bent);
    expect(again.faces).toEqual(mesh.faces);
    expect(again.positions[3 * last]! - mesh.positions[3 * last]!).toBeCloseTo(0.1, 4);
    ++kept;
  }
  expect(kept).toBeGreaterThan(15);
}, 300_000);
