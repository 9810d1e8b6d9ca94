import { describe, expect, it } from "vitest";
import { morphGlb } from "../src/io/gltf_morphs.js";
import { readNumbers } from "lpdeform-client/mesh/gltf_accessors";
import { type Part, readGltfDocument } from "lpdeform-client/mesh/gltf_document";
import { parseMesh } from "lpdeform-client/mesh/read";
import { addHandle, changeHandle, type Document, emptyDocument, handleOf } from "../src/model/document.js";
import { momentsOf, shapeAt } from "../src/model/film.js";
import { keyPoseOf } from "../src/model/key_poses.js";
import { faultsOf } from "./gltf_validator.js";

const rest = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0]);
const held = addHandle({ ...emptyDocument, p: 1 }, [1], rest, { name: "a" });
const moved = (x: number): Document => changeHandle(held, "a", { pose: { ...held.handles[0]!.pose, translation: [x, 0, 0] } });

function withPoses(...places: number[]): Document {
  return places
    .map(moved)
    .reduce(
      (made, at) => ({ ...made, keyPoses: [...(made.keyPoses ?? []), keyPoseOf({ ...at, keyPoses: made.keyPoses ?? [] })] }),
      held,
    );
}

describe("a film of poses", () => {
  it("has the poses and what is between them, evenly in time, slow at each pose", () => {
    const moments = momentsOf(withPoses(0, 4, 2), 4);
    expect(moments.map(({ name }) => name)).toEqual([
      "Pose 1",
      "Pose 1 to Pose 2, 25 %",
      "Pose 1 to Pose 2, 50 %",
      "Pose 1 to Pose 2, 75 %",
      "Pose 2",
      "Pose 2 to Pose 3, 25 %",
      "Pose 2 to Pose 3, 50 %",
      "Pose 2 to Pose 3, 75 %",
      "Pose 3",
    ]);
    const places = moments.map(({ document }) => handleOf(document, "a")!.pose.translation[0]);
    expect(places).toEqual([0, 0.625, 2, 3.375, 4, 3.6875, 3, 2.3125, 2]);
    expect(momentsOf(held, 4)).toEqual([]);
  });

  it("is interpolated between its shapes, and stays at its ends", () => {
    const shapes = [0, 2, 6].map((x) => ({ positions: Float32Array.of(x), distortion: Float32Array.of(10 * x) }));
    const at = (place: number) => [shapeAt(shapes, place).positions[0], shapeAt(shapes, place).distortion[0]];
    expect([-1, 0, 0.5, 1, 1.25, 2, 9].map(at)).toEqual([
      [0, 0],
      [0, 0],
      [1, 10],
      [2, 20],
      [3, 30],
      [6, 60],
      [6, 60],
    ]);
  });

  it("is a GLB whose targets are the shapes less the first, and whose animation shows each at its time", async () => {
    const stills = [0, 1, 3].map((by, k) => ({
      name: `Pose ${k}`,
      positions: rest.map((value, at) => value + (at % 3 === 2 ? by : 0)),
      normals: k === 2 ? new Float32Array(9) : Float32Array.from([0, 0, 5, 0, 3, 4, 0, 0, 1]),
    }));
    const glb = morphGlb("a.off", new Uint32Array([0, 1, 2]), stills, 0.5);
    expect(await faultsOf(glb)).toEqual([]);
    const mesh = parseMesh("a.glb", glb);
    expect([mesh.positions, mesh.faces]).toEqual([rest, new Uint32Array([0, 1, 2])]);
    const document = readGltfDocument("a.glb", glb, new Map());
    const [{ primitives, extras }] = document.json["meshes"] as [{ primitives: [Part]; extras: Part }];
    expect(extras["targetNames"]).toEqual(["Pose 1", "Pose 2"]);
    const [, second] = primitives[0]["targets"] as { POSITION: number; NORMAL: number }[];
    expect([...readNumbers(document, second!.POSITION, 3)]).toEqual([0, 0, 3, 0, 0, 3, 0, 0, 3]);
    expect(readNumbers(document, second!.NORMAL, 3)[4]).toBeCloseTo(-0.6, 6);
    const [{ samplers }] = document.json["animations"] as [{ samplers: [{ input: number; output: number }] }];
    expect([...readNumbers(document, samplers[0].input, 1)]).toEqual([0, 0.5, 1]);
    expect([...readNumbers(document, samplers[0].output, 1)]).toEqual([0, 0, 1, 0, 0, 1]);
  });
});
