import { describe, expect, it } from "vitest";
import { writeObj } from "../src/io/write_obj.js";
import { rewriteObj } from "../src/io/obj_rewrite.js";
import { writeOff } from "../src/io/write_off.js";
import { writePly } from "../src/io/write_ply.js";
import { parseMesh } from "lpdeform-client/mesh/read";
import { type Mesh, polygonsOf } from "lpdeform-client/mesh/mesh";

const bytes = (text: string) => new TextEncoder().encode(text);
const text = (bytes: Uint8Array) => new TextDecoder().decode(bytes);

/** A box without its lid, of quads and a pentagon, with all that engines put beside. */
const file = `# made by hand
mtllib box.mtl
o Box
v 0 0 0 0.1 0.2 0.3
v 1 0 0 1 0 0
v 1 1 0 0 1 0
v 0 1 0 0 0 1
v 0 0 1 1 1 1
v 1 0 \\
 1 0 0 0
v 0.5 -1e-1 1.5 1 1 0 # the tip
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 -1
vn 0 -1 0
g bottom
usemtl red
s off
f 1/1/1 4/4/1 3/3/1 2/2/1
g front
usemtl blue
f -7/1/2 2/2/2 6/3/-1 7/3/2 5//2 # a pentagon
l 1 2
`;
const read = () => parseMesh("box.obj", bytes(file)) as Mesh & { obj: Uint8Array };
const at = ({ positions, exact }: Mesh) => [...(exact ?? positions)];
/** A quarter turn about x, and away. */
const turned = (positions: readonly number[]) =>
  Float64Array.from(positions, (_, k) => {
    const [x, y, z] = positions.slice(k - (k % 3), k - (k % 3) + 3) as [number, number, number];
    return [x + 5, 0 - z, y][k % 3]!;
  });
/** Without comments. */
const lines = (text: string, key: string) =>
  text.split("\n").flatMap((line) => (line.startsWith(`${key} `) ? [line.split(" #")[0]!] : []));

describe("an OBJ file that is saved again", () => {
  it("keeps texture coordinates, groups, materials, polygons, colours and the rest, line by line", () => {
    const written = text(rewriteObj(read(), turned(at(read()))));
    const kept = (text: string) => text.split("\n").filter((line) => !/^(v|vn|f) |^ /.test(line));
    expect(kept(written)).toEqual(kept(file));
    expect(lines(written, "v")[0]).toBe("v 5 0 0 0.1 0.2 0.3");
    expect(written).toContain("\nv 6 -1 \\\n 0 0 0 0\nv 5.5 -1.5 -0.1 1 1 0 # the tip\n");
    expect(written).toMatch(/^f -7.* # a pentagon$/m);
    const words = lines(written, "f").map((line) => line.split(" ").slice(1));
    expect(words.map((face) => face.map((word) => word.split("/").slice(0, 2).join("/")))).toEqual([
      ["1/1", "4/4", "3/3", "2/2"],
      ["-7/1", "2/2", "6/3", "7/3", "5/"],
    ]);
  });

  it("has the positions that it is given, to the last bit, and the same faces", () => {
    const positions = turned(at(read()));
    const again = parseMesh("box.obj", rewriteObj(read(), positions));
    expect(at(again)).toEqual([...positions]);
    expect([again.faces, again.corners]).toEqual([read().faces, read().corners]);
    expect([...again.beside!].sort()).toEqual([...read().beside!].sort()); // normals come later in it
  });

  it("has normals that turn with the surface, hard edges staying hard", () => {
    const written = text(rewriteObj(read(), turned(at(read()))));
    const normals = lines(written, "vn").map((line) => line.split(" ").slice(1).map(Number));
    const ofFaces = lines(written, "f").map((line) =>
      line
        .split(" ")
        .slice(1)
        .map((word) => normals[Number(word.split("/")[2]) - 1]!),
    );
    for (const [face, wanted] of [
      [0, [0, 1, 0]], // from 0, 0, -1
      [1, [0, 0, -1]], // from 0, -1, 0
    ] as const) {
      for (const normal of ofFaces[face]!) normal.forEach((value, axis) => expect(value).toBeCloseTo(wanted[axis]!, 6));
    }
    expect(normals.length).toBe(9); // the two faces share two vertices, and no normal there
    expect(written.indexOf("vn ")).toBeLessThan(written.indexOf("\nf "));
  });

  it("is the same where nothing has moved, its normals too", () => {
    const again = text(rewriteObj(read(), Float64Array.from(at(read()))));
    for (const normal of lines(again, "vn").map((line) => line.split(" ").slice(1).map(Number))) {
      expect(normal.map((value) => Math.round(1e6 * value) / 1e6 + 0)).toSatisfy(
        (one: number[]) => one.join() === "0,0,-1" || one.join() === "0,-1,0",
      );
    }
  });

  it.each(["\r\n", "\r"])("may have lines that end in %j", (end) => {
    const mesh = parseMesh("box.obj", bytes(file.replaceAll("\n", end))) as Mesh & { obj: Uint8Array };
    const written = text(rewriteObj(mesh, turned(at(read()))));
    expect(written.replaceAll(end, "")).not.toMatch(/[\r\n]/);
    const again = parseMesh("box.obj", bytes(written));
    expect(at(again)).toEqual([...turned(at(read()))]);
    expect(again.corners).toEqual(read().corners);
    expect([...again.beside!].sort()).toEqual([...read().beside!].sort());
  });

  it("keeps names in whatever encoding they are, and the mark at its beginning", () => {
    const every = Array.from({ length: 256 }, (_, byte) => byte).filter((byte) => ![10, 13, 92].includes(byte));
    const parts = [[0xef, 0xbb, 0xbf], bytes("v 0 0 0\nv 1 0 0\nv 0 1 0\ng "), every, bytes("\nf 1 2 3\n")];
    const obj = Uint8Array.from(parts.flatMap((part) => [...part]));
    const mesh = parseMesh("a.obj", obj) as ReturnType<typeof read>;
    expect(rewriteObj(mesh, mesh.positions)).toEqual(obj);
  });

  it("may have faces that name normals after them, which then come before them", () => {
    const late = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//2 2//2\t3//1\nvn 1 0 0\nvn 0 0 1\nf 3//-1  2//-1 1//-2\n";
    const mesh = parseMesh("a.obj", bytes(late)) as ReturnType<typeof read>;
    const normals = ["vn 0 0 1", "vn 0 0 1", "vn 1 0 0", "vn 0 0 1", "vn 1 0 0"];
    const [before, after] = ["v 0 0 0\nv 1 0 0\nv 0 1 0", "f 1//1 2//2\t3//3\nf 3//4  2//2 1//5\n"];
    expect(text(rewriteObj(mesh, mesh.positions))).toBe([before, ...normals, after].join("\n"));
  });

  it("has no normal at a corner that named one that is not there", () => {
    const few = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1//1 2//2 3/1/3\n";
    const mesh = parseMesh("a.obj", bytes(few)) as ReturnType<typeof read>;
    expect(lines(text(rewriteObj(mesh, mesh.positions)), "f")).toEqual(["f 1//1 2 3/1"]);
  });

  it("keeps a normal where the surface has no direction", () => {
    const flat = parseMesh("a.obj", bytes("v 0 0 0\nv 1 0 0\nv 2 0 0\nvn 0 0 1\nf 1//1 2//1 3//1\n")) as ReturnType<
      typeof read
    >;
    expect(lines(text(rewriteObj(flat, flat.positions)), "vn")).toEqual(["vn 0 0 1", "vn 0 0 1", "vn 0 0 1"]);
  });
});

describe("polygons", () => {
  it.each([
    ["obj", (mesh: Mesh) => bytes(writeObj(mesh))],
    ["off", (mesh: Mesh) => bytes(writeOff(mesh))],
    ["ply", (mesh: Mesh) => writePly(mesh, new Float32Array(7), 1)],
  ] as const)("are saved as such in %s", (ending, write) => {
    const again = parseMesh(`box.${ending}`, write(read()));
    expect([...polygonsOf(again)]).toEqual([
      [0, 3, 2, 1],
      [0, 1, 5, 6, 4],
    ]);
    expect([...again.faces]).toEqual([0, 3, 2, 0, 2, 1, 0, 1, 5, 0, 5, 6, 0, 6, 4]);
  });

  it("of more than 255 corners are saved as such in PLY", () => {
    const corners = 300;
    const circle = Array.from({ length: corners }, (_, k) => [Math.cos(k / 50), Math.sin(k / 50), 0].join(" "));
    const face = Array.from({ length: corners }, (_, k) => k);
    const mesh = parseMesh("a.off", bytes(`OFF\n${corners} 1 0\n${circle.join("\n")}\n${corners} ${face.join(" ")}\n`));
    const again = parseMesh("a.ply", writePly(mesh, new Float32Array(corners), 1));
    expect([...polygonsOf(again)]).toEqual([face]);
  });
});

describe("what a file has beside", () => {
  const head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const plain = "element face 1\nproperty list uchar int vertex_indices\n";
  const ply = (vertex: string, face: string, rows: string) => `${head}${vertex}${plain}${face}end_header\n${rows}`;
  const triangle = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  it.each<[string, string, readonly string[] | undefined]>([
    [
      "a.obj",
      file,
      ["materials", "objects", "colours of vertices", "texture coordinates", "normals", "groups", "smoothing groups", "lines"],
    ],
    ["a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", undefined],
    ["a.off", "COFF\n3 1 0\n0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2\n", ["colours of vertices"]],
    ["a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0\n", ["colours of faces"]],
    ["a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", undefined],
    ["a.ply", ply("", "", triangle), undefined],
    [
      "a.ply",
      ply(
        "property float nx\nproperty float s\nproperty uchar red\nproperty float quality\n",
        "",
        "0 0 0 1 1 1 1\n1 0 0 1 1 1 1\n0 1 0 1 1 1 1\n3 0 1 2\n",
      ),
      ["normals", "texture coordinates", "colours", "“quality”"],
    ],
    ["a.ply", ply("", "element edge 1\nproperty int vertex1\n", `${triangle}0\n`), ["its element “edge”"]],
    [
      "a.stl",
      "solid a\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendsolid a\nsolid b\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 1\nendsolid b\n",
      ["solids"],
    ],
  ])("is named: %s %#", (name, text, beside) => {
    expect(parseMesh(name, bytes(text)).beside).toEqual(beside);
  });

  it("is not the distortion that this page saves", () => {
    const mesh = parseMesh("a.off", bytes("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"));
    expect(parseMesh("a.ply", writePly(mesh, new Float32Array(3), 1)).beside).toBeUndefined();
  });
});
