import { OpenMesh } from "lpdeform-client/mesh";
import { isKnown, usualWelding } from "lpdeform-client/mesh/derived";
import { afterEach, expect, it, vi } from "vitest";
import { keepOnly, openedMesh, prepare } from "../src/io/opened.js";
import { splitTube } from "./split_tube.js";

afterEach(() => {
  vi.restoreAllMocks();
});

it("a mesh that could not be opened is opened again when it is asked for", async () => {
  const mesh = splitTube(12, 4);
  vi.spyOn(OpenMesh, "from").mockRejectedValueOnce(new RangeError("out of memory"));
  await expect(prepare(mesh, usualWelding)).rejects.toThrow("out of memory");
  await prepare(mesh, usualWelding);
  expect(isKnown(mesh, usualWelding)).toBe(true);
});

it("a mesh that could not be opened does not disturb another that is opened in its place", async () => {
  const mesh = splitTube(12, 4);
  vi.spyOn(OpenMesh, "from").mockRejectedValueOnce(new RangeError("out of memory"));
  const failing = prepare(mesh, usualWelding);
  keepOnly(splitTube(5, 5)); // a rejection that nobody handles would fail this run
  await expect(failing).rejects.toThrow("out of memory");
});

it("a file that is no mesh is refused with all that the page reads", async () => {
  const file = new File(["hello"], "notes.txt");
  await expect(openedMesh(file, [])).rejects.toThrow(
    "notes.txt is not a mesh that can be read: GLB, glTF, OFF, OBJ, PLY, STL, FBX, DAE and 3MF can.",
  );
});
