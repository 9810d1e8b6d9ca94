import { describe, expect, it } from "vitest";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { parseMesh } from "lpdeform-client/mesh/read";
import { keepsPly, rewritePly } from "../src/io/ply_rewrite.js";
import { writePly } from "../src/io/write_ply.js";

// A PLY that is saved as PLY keeps what it had besides its shape.

const bytes = (text: string) => new TextEncoder().encode(text);
const text = (data: Uint8Array) => new TextDecoder().decode(data);
type Kept = Mesh & { ply: Uint8Array };

function read(data: Uint8Array): Kept {
  const mesh = parseMesh("a.ply", data);
  expect(keepsPly(mesh)).toBe(true);
  return mesh as Kept;
}

const turned = ({ positions }: Mesh) =>
  Float64Array.from({ length: positions.length }, (_, k) => [positions[k]!, -positions[k + 1]!, positions[k - 1]!][k % 3]! + 0);

const asText = `ply
format ascii 1.0
comment of somebody
element stamp 1
property list uchar int words
element vertex 4
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float s
property float t
property uchar red
element face 2
property list uchar int vertex_indices
property int material
element edge 1
property int vertex1
property int vertex2
end_header
2 7 8
0 0 0   0 0 1  0.25 0.75 10
1 0 0 0 0 1 0.5 .75 20
1 1 0\t0 0 1 0.5 1e0 30
0 0.1 0 0 0 1 0.25 1.0 40
3 0 1 2 5
3 0 2 3 6

2 3
`;

describe("a PLY as text", () => {
  it("has new positions, turned normals and a distortion; all else stays, blanks too", () => {
    const mesh = read(bytes(asText));
    const distortion = Float32Array.of(0, 0.5, 0.1, 2);
    expect(text(rewritePly(mesh, turned(mesh), distortion))).toBe(
      asText
        .replace("property uchar red\n", "property uchar red\nproperty float distortion\n")
        .replace("0 0 0   0 0 1  0.25 0.75 10", "0 0 0   0 -1 0  0.25 0.75 10 0")
        .replace("1 0 0 0 0 1 0.5 .75 20", "1 0 0 0 -1 0 0.5 .75 20 0.5")
        .replace("1 1 0\t0 0 1 0.5 1e0 30", "1 0 1\t0 -1 0 0.5 1e0 30 0.100000001")
        .replace("0 0.1 0 0 0 1 0.25 1.0 40", "0 0 0.100000001 0 -1 0 0.25 1.0 40 2"),
    );
  });

  it("that has a distortion gets the new one in its place", () => {
    const mesh = read(bytes(asText));
    const once = rewritePly(mesh, turned(mesh), new Float32Array(4).fill(3));
    expect(text(rewritePly(read(once), turned(mesh), new Float32Array(4).fill(3)))).toBe(text(once));
    expect(text(rewritePly(read(once), turned(mesh), new Float32Array(4))).match(/ 0$/gm)).toHaveLength(4);
  });

  it("may have lines that end in a carriage return and a new line", () => {
    const mesh = read(bytes(asText.replaceAll("\n", "\r\n")));
    const written = text(rewritePly(mesh, turned(mesh), new Float32Array(4)));
    expect(written.replaceAll("\r\n", "")).not.toMatch(/[\r\n]/);
    expect(read(bytes(written)).positions).toEqual(Float32Array.from(turned(mesh)));
  });
});

/** The same file in numbers of double precision, and its rows. */
function binary(isLittle: boolean): { file: Uint8Array; head: string } {
  const head = asText
    .slice(0, asText.indexOf("2 7 8"))
    .replace("ascii", isLittle ? "binary_little_endian" : "binary_big_endian")
    .replaceAll("float", "double");
  const out: number[] = [];
  const put = (size: number, set: (view: DataView) => void) => {
    const view = new DataView(new ArrayBuffer(size));
    set(view);
    out.push(...new Uint8Array(view.buffer));
  };
  const byte = (value: number) => out.push(value);
  const int = (value: number) => put(4, (view) => view.setInt32(0, value, isLittle));
  const double = (value: number) => put(8, (view) => view.setFloat64(0, value, isLittle));
  byte(2);
  [7, 8].forEach(int);
  for (const [x, y, s, t, red] of [
    [0, 0, 0.25, 0.75, 10],
    [1, 0, 0.5, 0.75, 20],
    [1, 1, 0.5, 1, 30],
    [0, 0.1, 0.25, 1, 40],
  ]) {
    [x!, y!, 0, 0, 0, 1, s!, t!].forEach(double);
    byte(red!);
  }
  for (const face of [
    [0, 1, 2, 5],
    [0, 2, 3, 6],
  ]) {
    byte(3);
    face.forEach(int);
  }
  [2, 3].forEach(int);
  byte(99); // what comes after all rows
  return { file: Uint8Array.from([...bytes(head), ...out]), head };
}

describe.each([
  ["little", true],
  ["big", false],
])("a binary PLY, %s-endian,", (_, isLittle) => {
  const { file, head } = binary(isLittle);

  it("has new positions, turned normals and a distortion; all other bytes stay", () => {
    const mesh = read(file);
    const distortion = Float64Array.of(0, 0.5, 0.1, 2);
    const written = rewritePly(mesh, turned(mesh), distortion);
    const again = read(written);
    expect([...(again.exact ?? again.positions)]).toEqual([...turned(mesh)]);
    const newHead = head.replace("property uchar red\n", "property uchar red\nproperty double distortion\n");
    expect(text(written.subarray(0, newHead.length))).toBe(newHead);
    const [body, old] = [written.subarray(newHead.length), file.subarray(head.length)];
    const row = 8 * 8 + 1;
    expect(body.length).toBe(old.length + 4 * 8);
    expect(body.subarray(0, 9)).toEqual(old.subarray(0, 9));
    for (let vertex = 0; vertex < 4; ++vertex) {
      const view = new DataView(body.buffer, body.byteOffset + 9 + (row + 8) * vertex, row + 8);
      expect([3, 4, 5].map((k) => view.getFloat64(8 * k, isLittle) + 0)).toEqual([0, -1, 0]);
      expect(view.getFloat64(row, isLittle)).toBe(distortion[vertex]);
      const kept = old.subarray(9 + row * vertex + 48, 9 + row * (vertex + 1));
      expect(new Uint8Array(view.buffer, view.byteOffset + 48, row - 48)).toEqual(kept);
    }
    expect(body.subarray(9 + 4 * (row + 8))).toEqual(old.subarray(9 + 4 * row));
  });
});

describe("a PLY is not kept", () => {
  const plain = asText
    .replace(/property float (n[xyz]|s|t)\n/g, "")
    .replace("property uchar red\n", "")
    .replace(/element (stamp|edge) 1\n(property .*\n)+?(?=element|end_header)/g, "")
    .replace("property int material\n", "")
    .replace(/end_header[^]*/, "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");

  it.each([
    ["with nothing but a shape", plain],
    ["with coordinates that are integers", asText.replace("float x", "int x")],
    ["with normals that are integers", asText.replace("float nz", "char nz")],
  ])("%s", (_, file) => {
    expect(keepsPly(parseMesh("a.ply", bytes(file)))).toBe(false);
  });

  it("if the viewer wrote it, since its colours are those of the distortion", () => {
    const mesh = parseMesh("a.ply", bytes(plain));
    const again = parseMesh("b.ply", writePly(mesh, new Float32Array(4), 1));
    expect(again.beside).toBeUndefined();
    expect(again.ply).toBeUndefined();
  });
});

it("a type that JavaScript knows and PLY does not is refused by its line", () => {
  expect(() => parseMesh("a.ply", bytes(asText.replace("uchar red", "toString red")))).toThrow("a.ply, line 15");
});
