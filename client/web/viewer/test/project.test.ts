import { gunzipSync, gzipSync } from "node:zlib";
import { describe, expect, it } from "vitest";
import { newGlb } from "../src/io/write_glb.js";
import { gunzip, gzip } from "../src/io/gzip.js";
import { type Project, readProject, writeProject } from "../src/io/project.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { writeObj } from "../src/io/write_obj.js";
import { addHandle, changeHandle, type Document, paint } from "../src/model/document.js";
import { keyPoseOf } from "../src/model/key_poses.js";
import type { Vector3 } from "lpdeform-client/mesh/mesh";
import { apply, quaternionOf, scaled } from "../src/model/pose.js";
import { shapeKinds } from "../src/model/shapes.js";
import { firstView } from "../src/model/view.js";

const shape = shapeKinds[0]!.make("coarse");
const look = { position: [3, -4, 5], target: [0.5, 0, 1] } as const;
const view = {
  ...firstView,
  shape: "bar",
  selected: "Top",
  isSplit: true,
  pinned: 0.25,
  colourBy: "p",
  wireframe: true,
  search: { effort: 3, show: true },
} as const;
const vertexCount = shape.mesh.positions.length / 3;

function worked(): Document {
  const pose = { rotation: quaternionOf([1, 2, 3], 0.7), translation: [0.1, -0.2, 0.3], center: [0.5, 0.5, 5] } as const;
  const moved = changeHandle(shape.document, "Top", { pose, hold: { kind: "soft", weight: 3 }, colour: "#123abc" });
  const painted = paint(paint(moved, "p", [40, 41], 1.2, vertexCount), "stiffness", [50], 0.1, vertexCount);
  const made = { ...painted, p: 1.35, secondP: 8, isAutomatic: true };
  return { ...made, keyPoses: [keyPoseOf(made)] };
}

const project: Project = { mesh: shape.mesh, document: worked(), view, look };

/** With the head, and the bytes after it, changed. */
async function altered(
  change: (head: Record<string, any>) => void,
  rest = (bytes: Buffer) => bytes,
): Promise<Uint8Array<ArrayBuffer>> {
  const content = gunzipSync(await writeProject(project));
  const end = content.indexOf("\n");
  const head = JSON.parse(content.subarray(0, end).toString()) as Record<string, any>;
  change(head);
  return packed(Buffer.concat([Buffer.from(`${JSON.stringify(head)}\n`), rest(content.subarray(end + 1))]));
}

const packed = (content: string | Buffer) => new Uint8Array(gzipSync(content));
const read = (bytes: Uint8Array<ArrayBuffer>) => readProject("a.lpdeform", bytes);

describe("a project", () => {
  it("comes back with mesh, handles, fields, settings and camera", async () => {
    const { mesh, document, view: seen, look: from } = await read(await writeProject(project));
    expect(mesh).toEqual(shape.mesh);
    const { handles, ...settings } = document;
    const { handles: wanted, ...wantedSettings } = project.document;
    expect(settings).toEqual(wantedSettings);
    expect(handles.map(({ pose: _, ...rest }) => rest)).toEqual(wanted.map(({ pose: _, ...rest }) => rest));
    handles.forEach(({ pose }, k) => {
      const { rotation, translation } = wanted[k]!.pose;
      expect(pose.translation).toEqual(translation);
      pose.rotation.forEach((value, axis) => expect(value).toBeCloseTo(rotation[axis]!, 14)); // by way of axis and angle
    });
    expect(handles[1]!.pose.center).toEqual(wanted[1]!.pose.center);
    const { shape: id, selected, isSplit, pinned, colourBy, wireframe } = seen;
    expect({ id, selected, isSplit, pinned, colourBy, wireframe }).toEqual({
      id: "bar",
      selected: "Top",
      isSplit: true,
      pinned: 0.25,
      colourBy: "p",
      wireframe: true,
    });
    expect(from).toEqual(look);
  });

  it("has the scale of handles and of poses, and their places for the command line", async () => {
    const { handles } = project.document;
    const pose = scaled(handles[1]!.pose, [2, 1, 0.5]);
    const document = changeHandle(project.document, "Top", { pose });
    const bytes = await writeProject({ ...project, document: { ...document, keyPoses: [keyPoseOf(document)] } });
    const again = (await read(bytes)).document;
    expect(again.handles[1]).toEqual(document.handles[1]);
    expect(again.keyPoses![0]!.handles[1]!.pose).toEqual(pose);
    const head = JSON.parse(gunzipSync(bytes).toString("latin1").split("\n", 1)[0]!) as Record<string, any>;
    const [place] = head["handles"].handles[1].positions;
    const vertex = handles[1]!.vertices[0]!;
    const at = apply(pose, [...shape.mesh.positions.subarray(3 * vertex, 3 * vertex + 3)] as unknown as Vector3);
    at.forEach((value, axis) => expect(place[axis]).toBeCloseTo(value, 12));
    for (const scale of [[0, 1, 1], [1, 1], [1, 1, 1e9], "x"]) {
      const wrong = (head: Record<string, any>) => (head["marks"][1].pose = { ...pose, scale });
      await expect(read(await altered(wrong))).rejects.toThrow("the scaled pose of handle “Top” is none");
    }
  });

  it("has doubles, polygons, and an OBJ, GLB or PLY file whole", async () => {
    const off = parseMesh(
      "a.off",
      new TextEncoder().encode("OFF\n5 2 0\n0 0 0\n1.1 0 0\n1 1 0\n0 1 0\n2 2 0.3\n4 0 1 2 3\n3 1 4 2\n"),
    );
    expect([off.exact, off.corners]).not.toContain(undefined);
    const obj = parseMesh("b.obj", new TextEncoder().encode(`# mine\nvt 0 1\n${writeObj(shape.mesh)}`));
    const gltf = parseMesh("c.glb", newGlb(shape.mesh));
    const vertices = ["0 0 0 1", "1 0 0 2", "0 1 0 3"].join("\n");
    const head =
      "ply\nformat ascii 1.0\nelement vertex 3\n" + ["x", "y", "z", "s"].map((name) => `property float ${name}\n`).join("");
    const faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    const ply = parseMesh("d.ply", new TextEncoder().encode(`${head}${faces}${vertices}\n3 0 1 2\n`));
    expect(ply.ply).toBeDefined();
    for (const mesh of [off, obj, gltf, ply]) {
      const document = addHandle({ ...shape.document, handles: [] }, [0, 1], mesh.positions);
      expect((await read(await writeProject({ ...project, mesh, document }))).mesh).toEqual(mesh);
    }
  });

  it("has the MTL and the images that were opened with an OBJ", async () => {
    const files = { "b.mtl": "newmtl a\n", "Old Wood.png": "\x89PNG" };
    const beside = new Map(Object.entries(files).map(([name, text]) => [name, new TextEncoder().encode(text)]));
    const mesh = parseMesh("b.obj", new TextEncoder().encode(writeObj(shape.mesh)), beside);
    const again = (await read(await writeProject({ ...project, mesh, document: shape.document }))).mesh;
    const texts = Object.entries(again.materials!).map(async ([name, file]) => [name, await file.text()] as const);
    expect(Object.fromEntries(await Promise.all(texts))).toEqual(files);
    expect({ ...again, materials: undefined }).toEqual({ ...mesh, materials: undefined });
  });

  it("of more than it may hold is not written, and that is said", async () => {
    const huge = { arrayBuffer: async () => new ArrayBuffer(500e6) } as Blob;
    const materials = { "b.mtl": new Blob([]), "huge.png": huge };
    const obj = new TextEncoder().encode(writeObj(shape.mesh));
    const mesh = { ...parseMesh("b.obj", obj), materials };
    await expect(writeProject({ ...project, mesh })).rejects.toThrow("The project would hold more than 500 MB.");
  });

  it("may be without handles, and selects nothing that is not there", async () => {
    const document = { ...project.document, handles: [] };
    const again = await read(await writeProject({ ...project, document }));
    expect([again.document.handles, again.view.selected]).toEqual([[], undefined]);
    expect(again.document.stiffness).toEqual(document.stiffness);
  });

  it("of a view with keys of a later page is opened", async () => {
    expect((await read(await altered(({ view }) => (view.light = "matcap")))).view.shape).toBe("bar");
    expect((await read(await altered(({ view }) => (view.search.depth = 2)))).view.search).toEqual(view.search);
  });

  it("that is another file, cut off or changed is refused", async () => {
    const whole = await writeProject(project);
    await expect(read(new TextEncoder().encode("OFF\n3 1 0\n"))).rejects.toThrow("a.lpdeform is not a project of this page.");
    await expect(read(new Uint8Array(0))).rejects.toThrow("not a project");
    await expect(read(packed("hello"))).rejects.toThrow("it does not begin as one");
    await expect(read(packed("{}\n"))).rejects.toThrow("its format is another");
    await expect(read(whole.slice(0, -100))).rejects.toThrow("damaged or cut off");
    await expect(read(whole.slice(0, 2))).rejects.toThrow("damaged or cut off");
    const flipped = whole.slice();
    flipped[flipped.length - 6]! ^= 1; // of the checksum
    await expect(read(flipped)).rejects.toThrow("damaged or cut off");
  });

  it.each<[string, (head: Record<string, any>) => void, string]>([
    ["version", (head) => (head["version"] = 2), "is a project of version 2; this page reads version 1"],
    ["p", (head) => (head["p"] = 0.5), "p is 0.5, not a number from 1 to 12"],
    ["second p", (head) => (head["secondP"] = null), "secondP is null"],
    ["automatic", (head) => (head["isAutomatic"] = 1), "“isAutomatic” is neither true nor false"],
    ["mesh", (head) => (head["mesh"] = null), "the mesh has no name"],
    ["positions", (head) => (head["sections"][0].name = "other"), "the mesh has no positions"],
    ["faces", (head) => (head["sections"][1].kind = "f32"), "the mesh has no faces"],
    ["a section's kind", (head) => (head["sections"][0].kind = "constructor"), "no known kind"],
    ["a section's length", (head) => (head["sections"][1].length += 1), "ends within its section “faces”"],
    ["bytes that are left", (head) => head["sections"].pop(), "bytes after its last section"],
    [
      "a vertex that is not there",
      (head) => head["handles"].handles[0].vertices.push(1e6),
      "In the handles of a.lpdeform, handle “Base” has vertex 1000000",
    ],
    ["a hold", (head) => (head["handles"].handles[1].soft = -1), "“soft” of handle “Top” is -1"],
    ["colour", (head) => (head["marks"][0].colour = "url(x)"), "handle “Base” has no colour"],
    ["marks", (head) => (head["marks"] = []), "handle “Base” has no colour"],
    ["poses", (head) => (head["poses"] = {}), "“poses” is not a list"],
    ["the p of a pose", (head) => (head["poses"][0].p = 99), "pose 1 has no name of its own, no p"],
    ["a pose's rotation", (head) => (head["poses"][0].handles[1].pose.rotation = [2, 0, 0, 0]), "pose 1 has"],
    ["two poses of a name", (head) => head["poses"].push(head["poses"][0]), "pose 2 has no name of its own"],
    ["view", (head) => (head["view"].colourBy = "smell"), '“colourBy” of the view is "smell"'],
    ["search", (head) => (head["view"].search = { effort: 1001 }), '“search” of the view is {"effort":1001}'],
    ["share", (head) => (head["view"].search = { leastShare: "2" }), "“search” of the view"],
    ["shape", (head) => (head["view"].shape = "__proto__"), "“shape” of the view"],
    ["camera", (head) => (head["camera"].position = [0, 0]), "the camera has no place"],
    ["what it looks at", (head) => (head["camera"].target = head["camera"].position), "nothing to look at"],
  ])("with a fault is refused by name: %s", async (_, change, message) => {
    await expect(read(await altered(change))).rejects.toThrow(message);
  });

  it("whose mesh has a vertex without a place is refused by name", async () => {
    const infinite = (bytes: Buffer) => (bytes.writeFloatLE(Infinity, 12 * 7), bytes);
    await expect(read(await altered(() => undefined, infinite))).rejects.toThrow(
      "Vertex 7 of a.lpdeform: a vertex has no three finite",
    );
    const outside = (bytes: Buffer) => (bytes.writeUInt32LE(vertexCount, 12 * vertexCount + 12 * 3), bytes);
    await expect(read(await altered(() => undefined, outside))).rejects.toThrow(
      `Face 3 of a.lpdeform has vertex ${vertexCount}`,
    );
  });
});

it("a file that would become too large is not unpacked whole", async () => {
  const bomb = await gzip(new Uint8Array(20_000_000));
  expect(bomb.length).toBeLessThan(100_000);
  expect(await gunzip(bomb, 1_000_000)).toBeUndefined();
  expect((await gunzip(bomb, 20_000_000))!.length).toBe(20_000_000);
});
