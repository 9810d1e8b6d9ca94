import { join } from "node:path";
import { build, type Rollup } from "vite";
import { expect, test } from "vitest";

// Of the package as its users get it: built, by its name.

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

test("the decompressor is loaded by those alone who ask for it", async () => {
  const chunks = await chunksOf(
    `import { openSession } from "lpdeform-client"; openSession({ vertices: [], faces: [] });`,
  );
  const withDecoder = chunks.findIndex((chunk) => chunk.includes("WebAssembly"));
  expect(chunks.length).toBeGreaterThan(1);
  expect(withDecoder).toBeGreaterThan(0);
  expect(chunks[0]).toContain("grpc");
});
