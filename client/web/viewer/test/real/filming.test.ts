import { writeFileSync } from "node:fs";
import { beforeAll, expect, it } from "vitest";
import { readGltfDocument } from "lpdeform-client/mesh/gltf_document";
import { faultsOf } from "../gltf_validator.js";
import { columns, makeGlb, rows } from "../made_glb.js";
import { bar, withUser } from "./opened.js";
import type { User } from "./user.js";

let user: User;
withUser(bar, (one) => (user = one));

beforeAll(async () => {
  await user.page.locator("summary", { hasText: "Poses" }).click();
});

/** Runs `act` in the page 0.1 s after the recording begins. The recording lasts two seconds, and the test may be held up for longer. */
const whenRecording = (act: string) =>
  user.page.evaluate(`{
    const notice = document.querySelector(".notice");
    const look = new MutationObserver(() => {
      if (!notice.textContent.includes("Recording the poses… Escape stops it.")) return;
      look.disconnect();
      setTimeout(() => ${act}, 100);
    });
    look.observe(notice, { childList: true, characterData: true, subtree: true });
  }`);

const keep = () => user.page.getByRole("button", { name: "Keep this pose" }).click();

it("without two poses there is nothing to export, which is said", async () => {
  await keep();
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Poses as video" }).click();
  await user.page.locator(".notice.bad", { hasText: "two poses" }).waitFor();
});

it("Escape ends waiting for a server that does not answer", async () => {
  await keep();
  const requests = "**/lpdeform.v1.*/CreateSession";
  await user.page.route(requests, () => undefined); // without an answer
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Poses as GLB" }).click();
  await user.page.locator(".notice", { hasText: "Solving for the poses: 1 of" }).waitFor();
  await user.page.keyboard.press("Escape");
  await user.page.locator(".notice.bad", { hasText: "The poses were not exported." }).waitFor();
  await user.page.unroute(requests);
  await user.page.getByRole("button", { name: "Delete Pose 2" }).click();
});

it("poses are exported as morph targets, solved in between, and validated", async () => {
  const [vertex] = await user.ask<number[]>("document().handles[1].vertices");
  await user.drag(await user.vertexOnPage(vertex!), 150, 60);
  await keep();
  await user.settled();
  const glb = await user.save("Poses as GLB, with morph targets");
  if (process.env["SHOT"]) writeFileSync(`${process.env["SHOT"]}.glb`, glb);
  expect(await faultsOf(new Uint8Array(glb))).toEqual([]);
  const { json } = readGltfDocument("a.glb", new Uint8Array(glb), new Map());
  const [{ primitives, extras }] = json["meshes"] as [{ primitives: [{ targets: { POSITION: number }[] }]; extras: object }];
  expect(extras).toMatchObject({ targetNames: expect.arrayContaining(["Pose 1 to Pose 2, 50 %", "Pose 2"]) });
  const accessors = json["accessors"] as { max: number[] }[];
  const farthest = primitives[0].targets.map(({ POSITION }) => accessors[POSITION]!.max[0]!);
  expect(farthest).toEqual([...farthest].sort((a, b) => a - b));
  expect(farthest.at(-1)).toBeGreaterThan(0.5);
});

it("Escape ends the recording of a video, and the picture shows the work again", async () => {
  const downloads: string[] = [];
  user.page.on("download", (one) => downloads.push(one.suggestedFilename()));
  await whenRecording(
    `document.body.dispatchEvent(new KeyboardEvent("keydown", { code: "Escape", key: "Escape", bubbles: true }))`,
  );
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Poses as video" }).click();
  await user.page.locator(".notice.bad", { hasText: "The poses were not exported. Escape was pressed." }).waitFor();
  expect(downloads).toEqual([]);
  await user.settled();
});

it("poses are recorded as a video of the picture, whose last picture is the last pose", async () => {
  const before = await user.ask<string | undefined>("app.view.now.selected");
  const video = await user.save("Poses as video");
  if (process.env["SHOT"]) writeFileSync(`${process.env["SHOT"]}.webm`, video);
  expect(video.readUInt32BE(0)).toBe(0x1a45dfa3); // how WebM files begin
  const pictures = await user.page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const element = document.createElement("video");
    element.muted = true;
    element.src = URL.createObjectURL(new Blob([bytes], { type: "video/webm" }));
    await new Promise((resolve, reject) => {
      element.onloadeddata = resolve;
      element.onerror = () => reject(new Error("the video cannot be played"));
    });
    const { videoWidth: width, videoHeight: height } = element;
    const canvas = new OffscreenCanvas(width, height);
    const context = canvas.getContext("2d")!;
    /** The mean x of what is colourful. */
    const middle = () => {
      context.drawImage(element, 0, 0);
      const { data } = context.getImageData(0, 0, width, height);
      let [sum, count] = [0, 0];
      for (let at = 0; at < data.length; at += 4) {
        const [r, g, b] = [data[at]!, data[at + 1]!, data[at + 2]!];
        if (Math.max(r, g, b) - Math.min(r, g, b) < 70) continue;
        sum += (at / 4) % width;
        ++count;
      }
      return sum / count;
    };
    /** The picture that is shown next, with its own second: it may be one that an earlier seek has asked for. */
    const next = () =>
      new Promise<{ second: number; x: number }>((resolve, reject) => {
        element.requestVideoFrameCallback((_, { mediaTime }) => resolve({ second: mediaTime, x: middle() }));
        setTimeout(() => reject(new Error(`no picture at ${element.currentTime} s`)), 60_000);
      });
    const at = async (seconds: number) => {
      const sought = new Promise((resolve) => (element.onseeked = resolve));
      const shown = next();
      element.currentTime = seconds;
      await sought;
      return shown;
    };
    const shown = [await at(1e9)]; // as far as it goes
    const seconds = element.currentTime;
    for (let k = 19; k >= 0; --k) shown.push(await at((k * seconds) / 20));
    shown.sort((a, b) => a.second - b.second);
    return { width, height, seconds, shown };
  }, video.toString("base64"));
  expect(pictures.seconds).toBeGreaterThan(1.5);
  const [first, last] = [pictures.shown[0]!, pictures.shown.at(-1)!];
  expect(
    pictures.shown.some(({ x }) => x > first.x + 5 && x < last.x - 5),
    JSON.stringify(pictures),
  ).toBe(true);
  const size = await user.page.locator("canvas.stage").evaluate((canvas) => (canvas as HTMLCanvasElement).clientWidth);
  expect(pictures.width).toBeGreaterThan(0.3 * size);
  expect(await user.ask("app.view.now.selected")).toBe(before);
});

it("nothing is saved if another mesh is opened while the video is recorded", async () => {
  let downloads = 0;
  user.page.on("download", () => ++downloads);
  await whenRecording(`void window.__lpdeform.app.openShape("sheet", "coarse")`);
  await user.page.getByRole("button", { name: "Save" }).click();
  await user.page.getByRole("menuitem", { name: "Poses as video" }).click();
  await user.page.locator(".notice.bad", { hasText: "The work has changed" }).waitFor();
  await user.settled();
  expect(downloads).toBe(0);
});

it("what the file of the mesh also had is not in a GLB of its poses, and the page says so", async () => {
  await user.openFiles({ name: "tube.glb", content: Buffer.from(makeGlb()) });
  await user.until(`window.__lpdeform.app.mesh.name === "tube.glb"`);
  const ends = [0, rows].map((row) => Array.from({ length: columns + 1 }, (_, column) => row * (columns + 1) + column));
  const handles = ends.map((vertices, k) => ({ name: `end ${k}`, vertices }));
  await user.openFiles({ name: "h.json", content: JSON.stringify({ handles }) });
  await user.handlesCame("end 1");
  await keep();
  await keep();
  await user.save("Poses as GLB, with morph targets");
  await user.page.locator(".notice", { hasText: /tube-poses.glb does not have what .* also had: .*materials/ }).waitFor();
});
