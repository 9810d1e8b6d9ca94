import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { checkPackage, createPackageFromTarballData, type Problem } from "@arethetypeswrong/core";
import { publint } from "publint";
import { build, type Rollup } from "vite";
import { expect, test } from "vitest";

// Of the package as its users get it: built, by its name.

const folder = join(import.meta.dirname, "..");

/** The files of the package, as npm makes it. */
const packed = new Set(
  (
    JSON.parse(execFileSync("npm", ["pack", "--dry-run", "--json"], { cwd: folder, encoding: "utf8" })) as [
      { files: { path: string }[] },
    ]
  )[0].files.map(({ path }) => path),
);

test("the package has its licence, and every file that its README names", () => {
  const readme = readFileSync(join(folder, "README.md"), "utf8");
  const links = [...readme.matchAll(/\]\(([^):#]+)\)/g)].map(([, link]) => link!);
  const examples = [...readme.matchAll(/`((?:\w+\/)*\w+\.ts)`/g)].map(([, name]) => name!);
  const named = [...links, ...examples.map((name) => (name.includes("/") ? name : `examples/${name}`))];
  expect(named.length).toBeGreaterThan(6);
  expect(["LICENSE", ...named].filter((name) => !packed.has(name))).toEqual([]);
  expect(readFileSync(join(folder, "LICENSE"), "utf8")).toBe(readFileSync(join(folder, "../../../LICENSE"), "utf8"));
});

test("the package has what the maps of its scripts show, and nothing of the tests", () => {
  const maps = [...packed].filter((path) => path.endsWith(".map"));
  expect(maps.length).toBeGreaterThan(20);
  for (const path of maps) {
    const { sources } = JSON.parse(readFileSync(join(folder, path), "utf8")) as { sources: string[] };
    for (const source of sources) expect(packed).toContain(join(dirname(path), source));
  }
  expect([...packed].filter((path) => /test|bench|tsconfig/.test(path))).toEqual([]);
});

/** What a page that does only this has to load, chunk by chunk. */
async function chunksOf(code: string): Promise<string[]> {
  const id = "\0page";
  const built = (await build({
    root: join(import.meta.dirname, ".."),
    configFile: false,
    logLevel: "error",
    build: { write: false, minify: true, target: "es2022", rollupOptions: { input: "page" } },
    plugins: [
      {
        name: "page",
        enforce: "pre",
        resolveId: (source) => (source === "page" ? id : undefined),
        load: (loaded) => (loaded === id ? code : undefined),
      },
    ],
  })) as Rollup.RollupOutput;
  return built.output.map((chunk) => (chunk.type === "chunk" ? chunk.code : ""));
}

test("what is not used is not loaded", async () => {
  const [errors] = await chunksOf(
    `import { LpdeformError } from "lpdeform-client"; console.log(new LpdeformError("aborted", ""));`,
  );
  expect(errors!.length).toBeLessThan(10_000);
  expect(errors).not.toContain("grpc");
});

test("reading of mesh files is loaded by those alone who ask for it, without the connection to a server", async () => {
  const [first] = await chunksOf(`import { readMesh } from "lpdeform-client/mesh"; readMesh(new File([], "a.obj"));`);
  expect(first).toContain("usemtl");
  expect(first).not.toContain("grpc");
  const session = `import { openSession } from "lpdeform-client"; openSession({ vertices: [], faces: [] });`;
  for (const chunk of await chunksOf(session)) expect(chunk).not.toContain("usemtl");
});

test("the decompressor is loaded by those alone who ask for it", async () => {
  const chunks = await chunksOf(
    `import { openSession } from "lpdeform-client"; openSession({ vertices: [], faces: [] });`,
  );
  const withDecoder = chunks.findIndex((chunk) => chunk.includes("WebAssembly"));
  expect(chunks.length).toBeGreaterThan(1);
  expect(withDecoder).toBeGreaterThan(0);
  expect(chunks[0]).toContain("grpc");
});

test("tools that look at packages as Node, bundlers and TypeScript do find no fault; it is for ESM alone", async () => {
  const folderOfTarball = mkdtempSync(join(tmpdir(), "lpdeform-package-"));
  try {
    const made = execFileSync("npm", ["pack", "--json", "--pack-destination", folderOfTarball], {
      cwd: folder,
      encoding: "utf8",
    });
    const [{ filename }] = JSON.parse(made) as [{ filename: string }];
    const tarball = new Uint8Array(readFileSync(join(folderOfTarball, filename)));
    const { messages } = await publint({ pack: { tarball: tarball.buffer }, strict: true });
    expect(messages).toEqual([]);
    const entrypoints = [".", "./mesh", "./mesh/derived", "./mesh/mesh", "./mesh/read"];
    const checked = await checkPackage(createPackageFromTarballData(tarball), { entrypoints });
    if (!checked.types) throw new Error("the package has no types");
    expect(Object.keys(checked.entrypoints)).toEqual(entrypoints);
    // Resolution before Node 12.7 knows no `exports`, and CommonJS takes ESM by `import()`.
    const elsewhere = ["node10", "node16-cjs"];
    const kindOf = (problem: Problem) => ("resolutionKind" in problem ? problem.resolutionKind : "");
    expect(checked.problems.filter((problem) => !elsewhere.includes(kindOf(problem)))).toEqual([]);
  } finally {
    rmSync(folderOfTarball, { recursive: true });
  }
});
