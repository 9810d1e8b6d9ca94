import { type ChildProcess, execFileSync, spawn, spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type Browser, chromium, type Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, expect, test } from "vitest";
import { Service } from "../support/service.js";

// A new project of Vite, in a folder that knows nothing of this one, with the package as npm packs it: the README's first program
// from a page of the development server, of a build, and through the development server's own proxy.

const client = join(import.meta.dirname, "../..");
const { devDependencies } = JSON.parse(readFileSync(join(client, "package.json"), "utf8")) as {
  devDependencies: Record<string, string>;
};

let work: string;
let project: string;
let service: Service;
let browser: Browser;
let port: number;
let serving: ChildProcess | undefined;

const run = (program: string, ...args: string[]) =>
  execFileSync(program, args, { cwd: project, encoding: "utf8", stdio: ["ignore", "pipe", "pipe"] });
const vite = () => join(project, "node_modules/vite/bin/vite.js");

function freePort(): Promise<number> {
  return new Promise((resolve) => {
    const server = createServer().listen(0, "127.0.0.1", () => {
      const { port } = server.address() as { port: number };
      server.close(() => resolve(port));
    });
  });
}

/** The page's own origin. */
const origin = () => `http://127.0.0.1:${port}`;

/** The first program of the README, for a strip whose right end it lifts by 1; it shows the height. */
function program(url: string): string {
  const readme = readFileSync(join(client, "README.md"), "utf8");
  const first = /^```ts\n(.*?)^```$/ms.exec(readme)![1]!.replace('"http://localhost:8080"', url);
  return `
    const vertices = new Float32Array(Array.from({ length: 22 }, (_, i) => [Math.floor(i / 2), i % 2, 0]).flat());
    const faces = Array.from({ length: 60 }, (_, k) => 2 * Math.floor(k / 6) + [0, 2, 3, 0, 3, 1][k % 6]!);
    const base = [0, 1], tip = [20, 21];
    ${first}
    document.body.append(\`The tip is at height \${frame.positions[3 * 20 + 2]}.\`);
    await session.close();
  `;
}

async function serve(...args: string[]): Promise<void> {
  const program = [vite(), ...args, "--host", "127.0.0.1", "--port", String(port), "--strictPort"];
  serving = spawn(process.execPath, program, { cwd: project, stdio: "ignore" });
  const isUp = () =>
    fetch(origin()).then(
      ({ ok }) => ok,
      () => false,
    );
  while (!(await isUp())) {
    if (serving.exitCode !== null) throw new Error(`vite ${args.join(" ")} has ended with ${serving.exitCode}`);
    await new Promise((again) => setTimeout(again, 50));
  }
}

async function stopServing(): Promise<void> {
  const child = serving;
  serving = undefined;
  if (!child || child.exitCode !== null) return;
  await new Promise((ended) => {
    child.once("exit", ended);
    child.kill();
  });
}

async function opened(): Promise<{ page: Page; errors: string[] }> {
  const page = await browser.newPage();
  page.setDefaultTimeout(100_000);
  const errors: string[] = [];
  page.on("pageerror", ({ message }) => errors.push(message));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  await page.goto(origin());
  return { page, errors };
}

/** The README's program bends the tube in the page. */
async function runs(): Promise<void> {
  const { page, errors } = await opened();
  await page.getByText("The tip is at height 1.").waitFor();
  expect(errors).toEqual([]);
  await page.close();
}

/**
 * A page that uses a worker shows this text. The development server prepares a package when a page first asks for it, and may refuse
 * what the page asks for meanwhile (504) and let it load again. So its page is opened twice, and the second time counts.
 */
async function shows(text: string, command: string): Promise<void> {
  if (command === "dev") {
    const { page } = await opened();
    await page.getByText(text).waitFor();
    await page.close();
  }
  const { page, errors } = await opened();
  await page.getByText(text).waitFor();
  expect(page.workers()).toHaveLength(1);
  expect(errors).toEqual([]);
  await page.close();
}

beforeAll(async () => {
  work = mkdtempSync(join(tmpdir(), "lpdeform-vite-"));
  project = join(work, "page");
  mkdirSync(project);
  execFileSync("npm", ["pack", "--pack-destination", work], { cwd: client, stdio: "ignore" });
  const packed = readdirSync(work).find((name) => name.endsWith(".tgz"))!;
  const [viteVersion, typescript] = [devDependencies["vite"]!, devDependencies["typescript"]!];
  writeFileSync(
    join(project, "package.json"),
    JSON.stringify({
      private: true,
      type: "module",
      dependencies: { "lpdeform-client": `file:../${packed}` },
      devDependencies: { typescript, vite: viteVersion },
    }),
  );
  // What deploy/install has brought is in npm's store; what is not comes from the registry.
  run("npm", "install", "--prefer-offline", "--ignore-scripts", "--no-audit", "--no-fund");
  writeFileSync(
    join(project, "index.html"),
    '<!doctype html><link rel="icon" href="data:,"><body><script type="module" src="/main.ts"></script></body>',
  );
  // As Vite's own template for TypeScript has it.
  const compilerOptions = {
    target: "es2022",
    lib: ["ES2022", "DOM", "DOM.Iterable"],
    module: "esnext",
    moduleResolution: "bundler",
    moduleDetection: "force",
    noEmit: true,
    strict: true,
    verbatimModuleSyntax: true,
    types: [],
  };
  writeFileSync(join(project, "tsconfig.json"), JSON.stringify({ compilerOptions, include: ["main.ts"] }));
  port = await freePort();
  service = await Service.start({ origins: [origin()] });
  browser = await chromium.launch({
    executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
    args: ["--no-sandbox"],
  });
}, 300_000);

afterEach(stopServing);

afterAll(async () => {
  await browser?.close();
  await service?.stop();
  rmSync(work, { recursive: true, force: true });
});

test("it type-checks as it stands, without skipLibCheck", () => {
  writeFileSync(join(project, "main.ts"), program(JSON.stringify(service.url)));
  const { stdout } = spawnSync(process.execPath, [join(project, "node_modules/typescript/bin/tsc")], { cwd: project });
  expect(stdout.toString()).toBe("");
}, 120_000);

test("it runs on the development server's page, which is of another origin than the proxy", async () => {
  writeFileSync(join(project, "main.ts"), program(JSON.stringify(service.url)));
  await serve();
  await runs();
}, 120_000);

test("it runs as it is built", async () => {
  writeFileSync(join(project, "main.ts"), program(JSON.stringify(service.url)));
  run(process.execPath, vite(), "build", "--target", "es2022");
  await serve("preview");
  await runs();
}, 120_000);

test("it runs through the development server's proxy, and then the page's own origin is the address", async () => {
  const readme = readFileSync(join(client, "README.md"), "utf8");
  const config = /^```js\n(.*?)^```$/ms
    .exec(readme)![1]!
    .replace('"http://localhost:8080"', JSON.stringify(service.url));
  writeFileSync(join(project, "vite.config.js"), config);
  writeFileSync(join(project, "main.ts"), program("location.origin"));
  try {
    await serve();
    await runs();
  } finally {
    rmSync(join(project, "vite.config.js"));
  }
}, 120_000);

test.each(["dev", "preview"])(
  "large compressed frames are unpacked, in a worker, on a page of %s",
  async (command) => {
    writeFileSync(
      join(project, "main.ts"),
      `
    import { openSession } from "lpdeform-client";
    const side = 150;
    const vertices = new Float32Array(Array.from({ length: side * side }, (_, i) => [i % side, Math.floor(i / side), 0]).flat());
    const corners = Array.from({ length: side * side }, (_, i) => i).filter((i) => i % side < side - 1 && i < side * (side - 1));
    const faces = corners.flatMap((i) => [i, i + 1, i + side, i + 1, i + side + 1, i + side]);
    const edge = (x: number) => Array.from({ length: side }, (_, y) => side * y + x);
    const session = await openSession({ vertices, faces }, { url: ${JSON.stringify(service.url)}, encoding: "compressed" });
    session.setHandles({ left: { vertices: edge(0) }, right: { vertices: edge(side - 1), motion: { translation: [0, 0, 9] } } });
    const frame = await session.settle();
    document.body.append(\`The edge is at height \${frame.positions[3 * (side - 1) + 2]!.toFixed(1)}.\`);
  `,
    );
    if (command === "preview") run(process.execPath, vite(), "build", "--target", "es2022");
    await serve(command);
    await shows("The edge is at height 9.0.", command);
  },
  120_000,
);

test.each(["dev", "preview"])(
  "a mesh file is read, and its frames shaded, in a worker, on a page of %s",
  async (command) => {
    writeFileSync(
      join(project, "main.ts"),
      `
    import { openSession } from "lpdeform-client";
    import { readMesh } from "lpdeform-client/mesh";
    const side = 120;
    const lines = Array.from({ length: side * side }, (_, i) => \`v \${i % side} \${Math.floor(i / side)} 0\`);
    for (let i = 1; i < side * (side - 1); ++i) if (i % side) lines.push(\`f \${i} \${i + 1} \${i + side + 1} \${i + side}\`);
    const opened = await readMesh(new File([lines.join("\\n")], "sheet.obj"));
    const edge = (x: number) => Array.from({ length: side }, (_, y) => side * y + x);
    const session = await openSession(opened.sessionMesh, {
      url: ${JSON.stringify(service.url)}, weld: opened.weld, shading: opened,
    });
    session.setHandles({ left: { vertices: edge(0) }, right: { vertices: edge(side - 1), motion: { translation: [0, 0, 9] } } });
    const { shaded } = await session.settle();
    const at = opened.derived.shown.drawn.source.indexOf(side - 1);
    document.body.append(\`The edge is drawn at height \${shaded!.positions[3 * at + 2]!.toFixed(1)}, \`);
    document.body.append(\`and its normal \${shaded!.normals[3 * at + 2]! > 0 ? "looks up" : "does not"}.\`);
  `,
    );
    if (command === "preview") run(process.execPath, vite(), "build", "--target", "es2022");
    await serve(command);
    await shows("The edge is drawn at height 9.0, and its normal looks up.", command);
  },
  120_000,
);
