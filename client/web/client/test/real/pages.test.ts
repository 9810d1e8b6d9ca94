import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type Browser, chromium, type Page } from "playwright-core";
import { build } from "vite";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Service } from "../support/service.js";

// The examples that are pages, each as Vite builds it, in Chromium, which draws by the processor.

let browser: Browser;
const opened: { service: Service; files: string; page: Page; errors: string[] }[] = [];

beforeAll(async () => {
  browser = await chromium.launch({
    executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium",
    args: ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"],
  });
});

afterAll(async () => {
  await browser?.close();
  for (const { service, files } of opened) {
    await service.stop();
    rmSync(files, { recursive: true, force: true });
  }
});

async function open(example: string): Promise<{ page: Page; errors: string[] }> {
  const files = mkdtempSync(join(tmpdir(), `lpdeform-${example}-`));
  const root = join(import.meta.dirname, "../../examples", example);
  await build({ root, base: "./", logLevel: "error", configFile: false, build: { outDir: files, target: "es2022" } });
  const service = await Service.start({ files });
  const context = await browser.newContext({ viewport: { width: 800, height: 600 }, bypassCSP: true });
  const page = await context.newPage();
  const errors: string[] = [];
  page.on("pageerror", ({ message }) => errors.push(message));
  page.on("console", (message) => message.type() === "error" && errors.push(message.text()));
  opened.push({ service, files, page, errors });
  await page.goto(`${service.url}/?url=${service.url}`);
  return { page, errors };
}

/** The share of the picture's pixels that are of the cylinder's blue, left and right of the middle. */
interface Blue {
  left: number;
  right: number;
}

async function blueOf(page: Page): Promise<Blue> {
  const picture = (await page.screenshot()).toString("base64");
  return page.evaluate(async (picture) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${picture}`)).blob());
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d")!;
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const found = { left: 0, right: 0 };
    for (let k = 0; k < data.length; k += 4) {
      const isBlue = data[k + 2]! > data[k]! + 40;
      if (isBlue) found[(k / 4) % image.width < image.width / 2 ? "left" : "right"] += 4 / data.length;
    }
    return found;
  }, picture);
}

const isStraight = ({ left, right }: Blue) => left > 0.01 && Math.abs(left - right) < 0.01;

async function until(page: Page, isSo: (blue: Blue) => boolean): Promise<void> {
  while (!isSo(await blueOf(page))) await page.waitForTimeout(100);
}

test("three.js: the cylinder bends to where its end is dragged", async () => {
  const { page, errors } = await open("three");
  await page.getByText("Energy").waitFor();
  await until(page, isStraight);
  await page.mouse.move(400, 83); // where the ball is
  await page.mouse.down();
  await page.mouse.move(600, 150, { steps: 20 });
  await page.mouse.up();
  await until(page, ({ left, right }) => right > 1.5 * left);
  expect(errors).toEqual([]);
}, 120_000);

/** A tube about the y axis, as a file of many lines: its vertices are split along a seam. */
function tubeObj(around = 40, along = 150): string {
  const lines: string[] = [];
  for (let ring = 0; ring <= along; ++ring) {
    for (let k = 0; k <= around; ++k) {
      const turn = (2 * Math.PI * (k % around)) / around;
      lines.push(`v ${0.3 * Math.cos(turn)} ${(3 * ring) / along} ${0.3 * Math.sin(turn)}`);
    }
  }
  for (let ring = 0; ring < along; ++ring) {
    for (let k = 1; k <= around; ++k) {
      const a = ring * (around + 1) + k;
      lines.push(`f ${a} ${a + around + 1} ${a + around + 2} ${a + 1}`);
    }
  }
  return lines.join("\n");
}

test("a file: a worker reads, welds and shades it, and says what is wrong with one that is damaged", async () => {
  const { page, errors } = await open("file");
  const choose = (text: string) =>
    page.getByLabel("Mesh").setInputFiles({ name: "tube.obj", mimeType: "model/obj", buffer: Buffer.from(text) });
  await choose(`${tubeObj()}\nf 1 2 9999`);
  await page.getByText("tube.obj, line 12192: face 6001 has the corner “9999”; there are 6191 vertices.").waitFor();
  await choose(tubeObj());
  await page.getByText("6191 vertices.").waitFor();
  await until(page, isStraight);
  await page.getByLabel("Shift").fill("0.4");
  await until(page, ({ left, right }) => right > 1.5 * left);
  await choose(tubeObj().replace("v ", "# another one\nv "));
  await until(page, isStraight);
  await page.getByLabel("Shift").fill("0.3");
  await until(page, ({ left, right }) => right > 1.3 * left);
  expect(page.workers()).toHaveLength(1); // that of the first is gone
  expect(errors).toEqual([]);
}, 120_000);

test("React: the cylinder bends as the slider says", async () => {
  const { page, errors } = await open("react");
  await until(page, isStraight);
  await page.getByLabel("Bend").fill("-90");
  await until(page, ({ left, right }) => right > 1.5 * left);
  await page.getByLabel("Bend").fill("90");
  await until(page, ({ left, right }) => left > 1.5 * right);
  expect(errors).toEqual([]);
}, 120_000);

test("a worker has the session, and the page draws what it sends", async () => {
  const { page, errors } = await open("worker");
  await page.getByText("The end is at height 0.00.").waitFor();
  await page.getByLabel("Lift").fill("7.5");
  await page.getByText("The end is at height 7.50.").waitFor();
  expect(page.workers()).toHaveLength(1);
  expect(errors).toEqual([]);
}, 120_000);
