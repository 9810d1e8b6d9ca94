import { describe, expect, it } from "vitest";
import { MeshBuilder } from "lpdeform-client/mesh/builder";
import { readHandleFile, writeHandleFile } from "../src/io/handlefile.js";
import { writeObj } from "../src/io/write_obj.js";
import { writeOff } from "../src/io/write_off.js";
import { writePly } from "../src/io/write_ply.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { writeStl } from "../src/io/write_stl.js";
import { emptyDocument } from "../src/model/document.js";
import { type HoldKind, holdKinds } from "../src/model/hold_kinds.js";
import { shapeKinds } from "../src/model/shapes.js";

const { mesh, document } = shapeKinds[3]!.make("coarse");
const bytes = (text: string) => new TextEncoder().encode(text);
const ply = (...lines: string[]) =>
  `${["ply", "format ascii 1.0", ...lines, ...(lines.includes("end_header") ? [] : ["end_header"])].join("\n")}\n`;
const distortion = Float32Array.from({ length: mesh.positions.length / 3 }, (_, k) => k / 7);

describe("meshes", () => {
  it.each([
    ["off", bytes(writeOff(mesh))],
    ["obj", bytes(writeObj(mesh))],
    ["ply", writePly(mesh, distortion, 3)],
  ] as const)("come back from %s as they went, to the last bit", (ending, written) => {
    const read = parseMesh(`creature.${ending}`, written);
    expect(read.positions).toEqual(mesh.positions);
    expect(read.faces).toEqual(mesh.faces);
  });

  it("of doubles come back as they went, to the last bit, beside what is drawn", () => {
    const exact = Float64Array.from(mesh.positions, (value, k) => value + 1e-9 * (k + 1));
    const written = { positions: exact, faces: mesh.faces };
    const doubles = Float64Array.from(distortion, (value) => value + 1e-12);
    for (const [ending, file] of [
      ["off", bytes(writeOff(written))],
      ["obj", bytes(writeObj(written))],
      ["ply", writePly(written, doubles, 3)],
    ] as const) {
      const read = parseMesh(`creature.${ending}`, file);
      expect(read.exact).toEqual(exact);
      expect(read.positions).toEqual(Float32Array.from(exact));
    }
    expect(parseMesh("a.off", bytes(writeOff(mesh))).exact).toBeUndefined();
  });

  it("come back from STL with the same triangles", () => {
    const read = parseMesh("creature.stl", writeStl(mesh));
    expect(read.positions.length).toBe(mesh.positions.length);
    const corners = ({ positions, faces }: typeof mesh) => [...faces].flatMap((v) => [...positions.subarray(3 * v, 3 * v + 3)]);
    expect(corners(read)).toEqual(corners(mesh));
  });

  it("are read with polygons, negative numbers, comments and texture coordinates", () => {
    const square = parseMesh("a.OBJ", bytes("# c\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1 -1/1 # quad\n"));
    expect([...square.faces]).toEqual([0, 1, 2, 0, 2, 3]);
    expect([...parseMesh("a.off", bytes("OFF # x\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n")).faces]).toEqual([0, 1, 2]);
    const ply =
      "ply\nformat ascii 1.0\ncomment c\nelement vertex 3\nproperty float nx\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_index\nend_header\n9 0 0 0\n9 1 0 0\n9 0 1 0\n3 0 1 2\n";
    expect([...parseMesh("a.ply", bytes(ply)).positions]).toEqual([0, 0, 0, 1, 0, 0, 0, 1, 0]);
    const stl =
      "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\nendloop\nendfacet\nendsolid";
    expect([...parseMesh("a.stl", bytes(stl)).faces]).toEqual([0, 1, 2]);
  });

  it("are read from PLY in the other byte order", () => {
    const head =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar uint vertex_indices\nend_header\n";
    const view = new DataView(new ArrayBuffer(72 + 13));
    [0, 0, 0, 1, 0, 0, 0, 1, 0].forEach((value, k) => view.setFloat64(8 * k, value));
    view.setUint8(72, 3);
    [0, 1, 2].forEach((value, k) => view.setUint32(73 + 4 * k, value));
    const read = parseMesh("a.ply", Uint8Array.from([...bytes(head), ...new Uint8Array(view.buffer)]));
    expect([...read.faces]).toEqual([0, 1, 2]);
    expect(read.positions[3]).toBe(1);
  });

  it.each([
    ["a.txt", "", "not a mesh that can be read"],
    ["a.ply", ply("element vertex 1e15", "element face 1"), "Element “vertex” of a.ply has no property"],
    ["a.ply", ply("element odd 1000000000000000", "element vertex 1"), "Element “odd” of a.ply has no property"],
    ["a.ply", ply("element vertex -1", "property float x"), "a.ply, line 3: the element “vertex” has the count “-1”"],
    ["a.ply", ply("element vertex 1.5", "property float x"), "a.ply, line 3: the element “vertex” has the count “1.5”"],
    ["a.ply", ply("element vertex many", "property float x"), "a.ply, line 3: the element “vertex” has the count “many”"],
    [
      "a.ply",
      ply("element face 1", "property list double int vertex_indices", "end_header", "1e20 0"),
      "a.ply, line 6, face 0: a list of 100000000000000000000 cannot be read",
    ],
    ["a.ply", ply("element face 1", "property list double int vertex_indices", "end_header", "-1 0"), "a list of -1 cannot"],
    ["a.ply", ply("element face 1", "property list float int vertex_indices", "end_header", "2.5 0"), "a list of 2.5 cannot"],
    ["a.ply", ply("element face 1", "property list float int vertex_indices", "end_header", "x 0"), "a list of NaN cannot"],
    [
      "a.ply",
      ply("element face 1", "property list uint int vertex_indices", "end_header", "4e9 0"),
      "face 0 of 1: the file ends before",
    ],
    [
      "a.off",
      "OFF\n1 1 0\n0 -2e18 0\n3 0 0 0\n",
      "a.off, line 3, vertex 0: a vertex lies farther out than 1000000000000000000",
    ],
    ["a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "face 0: it says that it has 4 corners, and names 3"],
    ["a.off", "COFFEE", "does not begin with OFF"],
    ["a.off", "OFF\n3 1 0\n0 0 0\n", "ends before vertex 1"],
    [
      "a.off",
      "OFF\n3 1 0\n0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n",
      "a.off, line 4, vertex 1: a vertex has no three finite coordinates",
    ],
    ["a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a.obj, line 4: face 1 has the corner “9”; there are 3 vertices"],
    [
      "a.obj",
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\nf -1 -2 -4/1\n",
      "line 6: face 2 has the corner “-4/1”; 3 vertices come before",
    ],
    [
      "a.off",
      "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n# two\n4 0 1 2 3\n3 0 1 7\n",
      "a.off, line 9: face 1 has vertex 7; there are 4",
    ],
    [
      "a.off",
      "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n",
      "a.off, line 6, face 0: it says that it has 4 corners, and names 3",
    ],
    ["a.obj", "v 0 0 0\nf 1 1 1.5\n", "a.obj, line 2: face 1 has the corner “1.5”; there are 1 vertices"],
    ["a.obj", "v 0 0 0\nf 1 1\n", "a.obj, line 2, face 1: a face has 2 corners"],
    ["a.obj", "v 0 0 0\n\nv 1 0\n", "a.obj, line 3, vertex 2: a vertex has no three finite coordinates"],
    [
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n\n3 0 0 7\n",
      "a.ply, line 13: face 1 has vertex 7; there are 1",
    ],
    [
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty flot x\nend_header\n",
      "a.ply, line 4: a property has the type flot",
    ],
    ["a.obj", "v 0 0 0\n", "has no faces"],
    ["a.obj", "", "has no vertices"],
    [
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 0 0\n2 0 0\n",
      "a.ply, line 9, vertex 2 of 3: the file ends before it is whole",
    ],
    [
      "a.ply",
      "ply\r\nformat ascii 1.0\r\nelement vertex 2\r\nproperty float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n0 0 0\r\n\r\n1 nan 0\r\n",
      "a.ply, line 10, vertex 1: a vertex has no three finite coordinates",
    ],
    ["a.stl", "solid\nvertex 0 0 0\nvertex 1 x 0\nvertex 0 1 0\n", "a.stl, line 3, triangle 0: a vertex has no three"],
    ["a.ply", "ply\nformat zip 1.0\nend_header\n", "format “zip”"],
    ["a.ply", "nothing", "no PLY header"],
    ["a.stl", "solid\nendsolid", "has no vertices"],
    ["a.stl", "solid\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 0 0 0\n", "a.stl ends within triangle 1"],
  ])("%s with a fault is refused by name: %s", (name, text, message) => {
    expect(() => parseMesh(name, bytes(text))).toThrow(message);
  });

  it("with more than a page can take are refused before they are taken in", () => {
    const builder = new MeshBuilder(2000);
    for (let k = 0; k < 2000; ++k) builder.vertex(0, 0, 0, "a.off, vertex");
    expect(() => builder.vertex(0, 0, 0, "a.off, vertex 2000")).toThrow(
      "a.off, vertex 2000: this page takes 2,000 vertices at most.",
    );
    for (let k = 0; k < 2000; ++k) builder.polygon([0, 1, 2], "a.off, face");
    expect(() => builder.polygon([0, 1, 2], "a.off, face 2000")).toThrow("this page takes 2,000 triangles at most");
  });

  it.each(["utf16le", "latin1"] as const)("in UTF-16 are refused by that name (%s)", (encoding) => {
    const text = Buffer.from(encoding === "latin1" ? "\xfe\xff\0v" : "\ufeffv 0 0 0", encoding);
    for (const name of ["a.obj", "a.off"]) expect(() => parseMesh(name, text)).toThrow(`${name} is in UTF-16`);
  });

  it("cut short is refused", () => {
    expect(() => parseMesh("a.stl", writeStl(mesh).subarray(0, 300))).toThrow("ends too soon");
    expect(() => parseMesh("a.ply", writePly(mesh, distortion, 1).subarray(0, 900))).toThrow(
      /a.ply, vertex \d+ of \d+: the file ends before/,
    );
  });
});

describe("a handle file", () => {
  const full = {
    mesh: "x",
    note: "n",
    handles: [
      { name: "base", vertices: [0, 1, 2] },
      {
        name: "tip",
        vertices: [7, 8],
        translate: [0, 0, 1],
        rotate: { axis: [0, 0, 2], angle_degrees: 30, center: [0.5, 0, 0] },
      },
      { name: "free", vertices: [9], positions: [[1, 2, 3]] },
      { name: "drawn", vertices: [11, 12], translate: [1, 0, 0], soft: 0.5 },
      { name: "pin", points: [{ face: 5, barycentric: [0.2, 0.3, 0.5] }] },
      { name: "rail", vertices: [14], axis_lock: [1, 0, 0], footprint: 0.25 },
      { name: "floor", vertices: [15], plane_lock: [0, 0, 1] },
      { name: "look", vertices: [16, 17], orientation: 100, rotate: { axis: [1, 0, 0], angle_degrees: -90 } },
    ],
    region: [0, 1, 2, 3, 7, 8],
    groups: [{ name: "soft", vertices: [20, 21], p: 1.2, stiffness: 0.1 }],
  };

  it("with everything that the command line knows comes back the same", () => {
    const once = readHandleFile(JSON.stringify(full), emptyDocument, mesh);
    expect(once.handles.map(({ name }) => name)).toEqual(full.handles.map(({ name }) => name));
    expect(once.handles[1]!.pose.translation).toEqual([0, 0, 1]);
    expect(once.handles[2]!.targets).toEqual([1, 2, 3]);
    expect(once.handles.map(({ hold }) => hold.kind)).toEqual([
      "exact",
      "exact",
      "exact",
      "soft",
      "exact",
      "axisLock",
      "planeLock",
      "orientation",
    ]);
    expect(once.paintedP![20]).toBeCloseTo(1.2);
    const written = writeHandleFile(once, mesh);
    const again = readHandleFile(written, emptyDocument, mesh);
    expect(JSON.parse(writeHandleFile(again, mesh))).toEqual(JSON.parse(written));
    const numbers = (json: unknown) =>
      JSON.stringify(json, (_, value: unknown) => (typeof value === "number" ? Number(value.toFixed(9)) : value));
    const { note: _, ...rest } = full;
    const parsed = JSON.parse(written) as typeof full;
    expect(parsed.groups).toEqual([
      { name: "p 1.2", vertices: [20, 21], p: 1.2 },
      { name: "stiffness 0.1", vertices: [20, 21], stiffness: 0.1 },
    ]);
    expect(numbers(parsed.handles[3])).toBe(numbers({ name: "drawn", vertices: [11, 12], translate: [1, 0, 0], soft: 0.5 }));
    expect(parsed.region).toEqual(rest.region);
    expect(numbers(parsed.handles[1]!.rotate!.angle_degrees)).toBe("30");
  });

  it.each(Object.values<HoldKind>(holdKinds))("has the hold “$label” under its key and gives it back", ({ fresh, fileKey }) => {
    const [first, ...others] = document.handles;
    const written = writeHandleFile({ ...document, handles: [{ ...first!, hold: fresh }, ...others] }, mesh);
    if (fileKey) expect(written).toContain(`"${fileKey}":`);
    expect(readHandleFile(written, emptyDocument, mesh).handles[0]!.hold).toEqual(fresh);
  });

  it("keeps what the page begins with", () => {
    const again = readHandleFile(writeHandleFile(document, mesh), emptyDocument, mesh);
    expect(again.handles.map(({ vertices }) => vertices)).toEqual(document.handles.map(({ vertices }) => vertices));
  });

  const handles = (...list: object[]) => JSON.stringify({ handles: list });
  it.each([
    ["{", "not JSON"],
    ["[]", "In the handle file, the whole is not an object"],
    ['{"handles": [], "what": 1}', "“what”, which is not a key of it; known are handles, region, groups, mesh, note."],
    [
      handles({ name: "a", vertices: [0], rotation: [1, 0, 0], translate: [0, 0, 1] }),
      "handle “a” has “rotation”, which is not a key of it; known are name, vertices, points, translate, rotate,",
    ],
    [
      handles({ name: "a", vertices: [0], rotate: { axis: [0, 0, 1], angle: 30 } }),
      "“rotate” of handle “a” has “angle”, which is not a key of it; known are axis, angle_degrees, center.",
    ],
    [
      handles({ name: "a", points: [{ face: 0, barycentric: [1, 0, 0], weight: 1 }] }),
      "a point of handle “a” has “weight”, which is not a key of it; known are face, barycentric.",
    ],
    [
      '{"handles": [{"name": "a", "vertices": [0]}], "groups": [{"name": "g", "vertices": [1], "P": 2}]}',
      "group “g” has “P”, which is not a key of it; known are name, vertices, p, stiffness.",
    ],
    [handles(), "has no handle"],
    [handles({ name: "a", vertices: [0] }, { name: "a", vertices: [1] }), "two handles “a”"],
    [handles({ name: "a", vertices: [0] }, { name: "b", vertices: [0] }), "a vertex that another handle has"],
    [handles({ name: "a", vertices: [0, 0] }), "vertex 0 twice"],
    [handles({ name: "a", vertices: [-1] }), "vertex -1"],
    [handles({ name: "a", vertices: [] }), "has no vertex"],
    [handles({ name: "", vertices: [0] }), "1 to 128 bytes"],
    [handles({ name: "a" }), "either “vertices” or “points”"],
    [handles({ name: "a", vertices: [0], translate: [1, 2] }), "not [x, y, z]"],
    [handles({ name: "a", vertices: [0], rotate: { axis: [0, 0, 0], angle_degrees: 3 } }), "no direction"],
    [handles({ name: "a", vertices: [0], positions: [[1, 2, 3]], translate: [0, 0, 1] }), "beside “translate”"],
    [handles({ name: "a", vertices: [0], positions: [] }), "1 vertices and 0 positions"],
    [handles({ name: "a", vertices: [0], soft: -1 }), "“soft” of handle “a” is -1"],
    [handles({ name: "a", vertices: [0], soft: 1, axis_lock: [1, 0, 0] }), "held in two ways"],
    [handles({ name: "a", points: [{ face: 1e9, barycentric: [1, 0, 0] }] }), "face 1000000000"],
    ...[null, "30", [], {}].flatMap((value): [string, string][] => [
      [
        handles({ name: "a", vertices: [0], rotate: { axis: [0, 0, 1], angle_degrees: value } }),
        "“angle_degrees” of handle “a”",
      ],
      [handles({ name: "a", points: [{ face: value, barycentric: [1, 0, 0] }] }), `a point in face ${JSON.stringify(value)}`],
      [
        JSON.stringify({
          handles: [{ name: "a", vertices: [0] }],
          groups: [{ name: "g", vertices: [1], p: Array.isArray(value) ? [2] : value }],
        }),
        "“p” of group “g”",
      ],
    ]),
    ['{"handles": [{"name": "a", "vertices": [0]}], "groups": [{"name": "g", "vertices": [1], "p": 0.5}]}', "“p” of group “g”"],
  ])("with a fault is refused by name: %s", (text, message) => {
    expect(() => readHandleFile(text, emptyDocument, mesh)).toThrow(message);
  });
});
