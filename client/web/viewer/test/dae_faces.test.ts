import { faultsOf } from "./gltf_validator.js"; // first: it takes what the next one brings for a page
import "./foreign_in_node.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { readGltfDocument } from "lpdeform-client/mesh/gltf_document";
import { readNumbers } from "lpdeform-client/mesh/gltf_accessors";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { parseMesh } from "lpdeform-client/mesh/read";
import { describe, expect, it } from "vitest";
import { glbIn } from "../src/io/foreign_glb.js";
import { columns, makeDae, rows } from "./made_foreign.js";
import { samplesOf } from "./samples.js";

// Elements of COLLADA that the reader of three.js does not read, or not as they are. Whatever they are, the same faces come out as
// from <triangles>.

const converted = (content: string | Uint8Array<ArrayBuffer>) => glbIn(new File([content], "a.dae"));

async function meshOf(content: string | Uint8Array<ArrayBuffer>): Promise<Mesh> {
  const { glb } = await converted(content);
  expect(await faultsOf(new Uint8Array(glb))).toEqual([]);
  return parseMesh("a.glb", new Uint8Array(glb));
}

async function refusalOf(content: string): Promise<string> {
  const thrown = await converted(content).catch((error: unknown) => error);
  expect(thrown).toBeInstanceOf(FileFault);
  return (thrown as FileFault).message;
}

/** Each triangle by the places of its corners, begun at the least of them; in any order. */
function shapesOf({ positions, faces }: Mesh): string[] {
  const place = (v: number) => [...positions.subarray(3 * v, 3 * v + 3)].map((x) => x.toFixed(4)).join(" ");
  const all = Array.from({ length: faces.length / 3 }, (_, k) => {
    const corners = [...faces.subarray(3 * k, 3 * k + 3)].map(place);
    const first = corners.indexOf([...corners].sort()[0]!);
    return [...corners.slice(first), ...corners.slice(0, first)].join(", ");
  });
  return all.sort();
}

const dae = makeDae();
const vertexInput = '<input semantic="VERTEX" source="#vertices" offset="0"/>';
const lists = (all: readonly (readonly number[])[]) => all.map((one) => `<p>${one.join(" ")}</p>`).join("\n");

/** The tube with other faces, or with other elements. */
const faces = (elements: string, text = dae) => text.replace(/<triangles[^]*<\/triangles>/, elements);
const element = (name: string, count: number, inner: string) => `<${name} count="${count}">${vertexInput}\n${inner}</${name}>`;

const cells = Array.from({ length: rows * columns }, (_, k) => {
  const row = Math.floor(k / columns) * columns;
  const [a, b] = [row + (k % columns), row + ((k + 1) % columns)];
  return [a, b, b + columns, a + columns];
});
/** Of each row, closed. Two rows are joined by triangles of two corners. */
const rowStrips = Array.from({ length: rows }, (_, row) =>
  Array.from({ length: columns + 1 }, (_, k) => [(row + 1) * columns + (k % columns), row * columns + (k % columns)]).flat(),
);
const oneStrip = rowStrips.reduce((all, strip) => [...all, all.at(-1)!, strip[0]!, ...strip]);

describe("the faces of a tube", () => {
  it("are the same as <polygons> as in a <polylist>", async () => {
    const { length: count } = cells;
    const list = `<vcount>${cells.map(() => 4).join(" ")}</vcount><p>${cells.flat().join(" ")}</p>`;
    const polygons = await meshOf(faces(element("polygons", count, lists(cells))));
    expect(shapesOf(polygons)).toEqual(shapesOf(await meshOf(faces(element("polylist", count, list)))));
  });

  it.each<[string, string]>([
    ["fans", element("trifans", cells.length, lists(cells))],
    ["strips", element("tristrips", rows, lists(rowStrips))],
    ["strips that are joined", element("tristrips", 1, lists([oneStrip]))],
  ])("are the same as %s as in <triangles>", async (_, elements) => {
    expect(shapesOf(await meshOf(faces(elements)))).toEqual(shapesOf(await meshOf(dae)));
  });

  it("may be of all kinds in one mesh", async () => {
    const [first, second, third] = [cells.slice(0, 50), cells.slice(50, 100), cells.slice(100)];
    const triangles = third.flatMap(([a, b, c, d]) => [a, b, c, a, c, d]);
    const all = [
      element("trifans", 50, lists(first)),
      element("polygons", 0, ""),
      element("trifans", 50, lists(second)),
      element("triangles", 2 * third.length, `<p>${triangles.join(" ")}</p>`),
    ];
    expect(shapesOf(await meshOf(faces(all.join("\n"))))).toEqual(shapesOf(await meshOf(dae)));
  });
});

it("a tube's ends may be polygons of many corners", async () => {
  const ring = (row: number) => Array.from({ length: columns }, (_, k) => row * columns + k);
  const lids = element("polygons", 2, lists([ring(0).reverse(), ring(rows)]));
  const plain = await meshOf(dae);
  const closed = await meshOf(faces(`$&${lids}`));
  expect(closed.faces.length / 3).toBe(plain.faces.length / 3 + 2 * (columns - 2));
  const edges = new Map<string, number>();
  for (const shape of shapesOf(closed)) {
    const corners = shape.split(", ");
    corners.forEach((corner, k) => {
      const key = [corner, corners[(k + 1) % 3]!].join();
      edges.set(key, (edges.get(key) ?? 0) + 1);
    });
  }
  expect([...edges].every(([key, count]) => count === 1 && edges.has(key.split(",").reverse().join()))).toBe(true); // one solid
});

const outline = "<p>0 1 2 3</p>";

/** A plate of 4 by 4; corners 4 to 7 are a hole of 1 by 1, and 8 to 10 lie outside. */
function plate(polygons: string, count = 1): string {
  const places = [[0, 0], [4, 0], [4, 4], [0, 4], [1, 1], [1, 2], [2, 2], [2, 1], [5, 5], [6, 5], [6, 6]].flatMap((xy) => [...xy, 0]); // prettier-ignore
  const text = dae.replace(/(<float_array[^>]*count=")\d+(">)[^<]*/, `$1${places.length}$2${places.join(" ")}`);
  return faces(`<polygons count="${count}">${vertexInput}\n${polygons}</polygons>`, text);
}

function areaOf({ positions, faces }: Mesh): number {
  let area = 0;
  for (let k = 0; k < faces.length; k += 3) {
    const [a, b, c] = [0, 1, 2].map((n) => positions.subarray(3 * faces[k + n]!, 3 * faces[k + n]! + 3));
    const [u, v] = [b, c].map((end) => [0, 1, 2].map((axis) => end![axis]! - a![axis]!));
    area += Math.hypot(...[0, 1, 2].map((i) => u![(i + 1) % 3]! * v![(i + 2) % 3]! - u![(i + 2) % 3]! * v![(i + 1) % 3]!)) / 2;
  }
  return area;
}

it("a hole is left open, whichever way it turns", async () => {
  for (const hole of ["4 5 6 7", "7 6 5 4"]) {
    const mesh = await meshOf(plate(`<ph>${outline}<h>${hole}</h></ph>`));
    expect(mesh.faces.length / 3).toBe(8);
    expect(areaOf(mesh)).toBeCloseTo(15, 5);
  }
});

const own = "<polygons> of the geometry “tube” has a polygon";

it.each<[string, string]>([
  [plate(`<ph>${outline}\n<h>4 5</h></ph>`), `, line 19: ${own} 0 with a hole 0 of 2 corners.`],
  [plate(`<ph>${outline}\n<h></h></ph>`), `, line 19: ${own} 0 with a hole 0 of 0 corners.`],
  [plate(`<ph>${outline}<h>4 5 6 7</h>\n<h>8 9</h></ph>`), `, line 19: ${own} 0 with a hole 1 of 2 corners.`],
  [plate(`<ph>${outline}<h>8 9 10</h></ph>`), `, line 18: ${own} 0 with a hole that does not lie within its outline, or`],
  [plate(`${outline}\n<ph>${outline}<h>4 5 10</h></ph>`, 2), `, line 19: ${own} 1 with a hole that does not lie within its`],
  [plate(`<ph><p>4 5 6 7</p><h>0 1 2 3</h></ph>`), `, line 18: ${own} 0 with a hole that does not lie within its outline`],
  [plate(`<ph>${outline}<h>4 5 99</h></ph>`), `, line 18: ${own} 0 with vertex 99; there are 11, counted from 0.`],
  [plate(`<ph>${outline}<h>4 5 x</h></ph>`), ", line 18: <h> has “x”, which is no whole number from 0."],
  [plate("<ph><h>4 5 6 7</h></ph>"), `, line 18: ${own} 0 with 0 outlines <p> in place of 1.`],
  [plate(`<ph>${outline}${outline}</ph>`), `, line 18: ${own} 0 with 2 outlines <p> in place of 1.`],
  [
    plate(`${outline}<h>4 5 6 7</h>`),
    ", line 18: <polygons> of the geometry “tube” has a hole <h> before a polygon 1 that is in no",
  ],
  [plate(`${outline}\n<p>0 1</p>`, 2), `, line 19: ${own} 1 with 2 corners.`],
  [plate(`${outline}<p></p>`, 2), `, line 18: ${own} 1 with 0 corners.`],
  [plate(`${outline}\n<p>0 1 11</p>`, 2), `, line 19: ${own} 1 with vertex 11; there are 11, counted from 0.`],
  [plate(`${outline}${outline}`, 3), ", line 17: <polygons> of the geometry “tube” says that it has 3 polygons, and has 2."],
  [plate(outline, 999999999999), " says that it has 999999999999 polygons, and has 1."],
  [
    plate(outline).replace('offset="0"', 'offset="2"'),
    `, line 18: ${own} 0 with 4 indices, which is no multiple of the 3 of a`,
  ],
  [plate(outline).replace('offset="0"', 'offset="99999999999999999999"'), " with 4 indices, which is no multiple of the 1"],
  [plate(`<p>${"0 1 2 3 ".repeat(2501)}</p>`), `, line 18: ${own} 0 with 10004 corners; this page reads 10000 at most.`],
  [
    plate(`<p>${"0 1 ".repeat(5000)}</p>\n`.repeat(2), 2),
    `, line 19: ${own} 1 after so many large ones that reading them takes too long.`,
  ],
])("wrong polygons are refused by their line (%#)", async (content, words) => {
  expect(await refusalOf(content)).toContain(`a.dae${words}`.slice(words.startsWith(",") ? 0 : 5));
});

it("polygons of many corners are refused early if they cross themselves", async () => {
  const round = Array.from({ length: 3000 }, (_, k) => [
    Math.cos((2 * Math.PI * k) / 3000),
    Math.sin((2 * Math.PI * k) / 3000),
    0,
  ]);
  const places = round.flat();
  const text = dae.replace(/(<float_array[^>]*count=")\d+(">)[^<]*/, `$1${places.length}$2${places.join(" ")}`);
  const polygons = (step: number, count: number) => {
    const list = `<p>${round.map((_, k) => (k * step) % 3000).join(" ")}</p>\n`;
    return faces(element("polygons", count, list.repeat(count)), text);
  };
  expect((await meshOf(polygons(1, 20))).faces.length / 3).toBe(20 * 2998);
  expect(await refusalOf(polygons(1409, 20))).toMatch(
    /has a polygon 6 after so many large ones that reading them takes too long\.$/,
  );
}, 60_000);

it.each<[string, string]>([
  ["tristrips", "strip"],
  ["trifans", "fan"],
])("wrong <%s> are refused by their line", async (name, item) => {
  const of = `a.dae, line 18: <${name}> of the geometry “tube” has a ${item} `;
  expect(await refusalOf(faces(element(name, 1, "<p>0 1</p>")))).toBe(`${of}0 with 2 corners.`);
  expect(await refusalOf(faces(element(name, 2, "<p>0 1 2</p><p>7</p>")))).toBe(`${of}1 with 1 corners.`);
  expect(await refusalOf(faces(element(name, 2, "<p>0 1 2</p><p/>")))).toBe(`${of}1 with 0 corners.`);
  const wrong = await refusalOf(faces(element(name, 1, "<p>0 1 2 204</p>")));
  expect(wrong).toBe(`${of}0 with vertex 204; there are 204, counted from 0.`);
  expect(await refusalOf(faces(element(name, 1, "<p>0 1 -2</p>")))).toContain(", line 18: <p> has “-2”, which is no whole");
  const holes = await refusalOf(faces(element(name, 1, "<ph><p>0 1 2</p></ph>")));
  expect(holes).toBe(`${of}0 with holes (<ph>), which only <polygons> can have.`);
  const counts = await refusalOf(faces(element(name, 2, "<p>0 1 2</p>")));
  expect(counts).toBe(`a.dae, line 17: <${name}> of the geometry “tube” says that it has 2 ${item}s, and has 1.`);
  expect(await refusalOf(faces(element(name, 1, "<p>5 5 5 5 6 6</p>")))).toBe("a.dae has no triangles.");
});

it("a file of strips with more triangles than a page can handle is refused", async () => {
  const strip = `<p>${"0 1 2 ".repeat(1_700_000)}</p>`;
  expect(await refusalOf(faces(element("tristrips", 1, strip)))).toBe(
    "a.dae has more than 5000000 triangles, which this page takes at most.",
  );
}, 60_000);

it("a geometry that stands in faces of another one is no part of the file", async () => {
  const inner = /<geometry[^]*<\/geometry>/.exec(faces(element("trifans", 1, "<p>0 1 2</p>")))![0];
  const all = faces(
    element("trifans", cells.length, lists(cells) + inner.replaceAll('id="', 'id="inner-').replaceAll("#", "#inner-")),
  );
  expect(shapesOf(await meshOf(all))).toEqual(shapesOf(await meshOf(dae)));
});

/** Sources of normals, texture coordinates and colours, one for each of the first four vertices, and a second material. */
function rich(elements: string): string {
  const source = (id: string, stride: number, numbers: readonly number[]) => `<source id="${id}">
    <float_array id="${id}-n" count="${numbers.length}">${numbers.join(" ")}</float_array><technique_common>
    <accessor source="#${id}-n" count="${numbers.length / stride}" stride="${stride}"/></technique_common></source>`;
  const sources = [
    source("n", 3, [1, 0, 0, 0, 1, 0, 0, 0, 1, -1, 0, 0]),
    source("uv", 2, [0, 0, 0.25, 0, 0.5, 0, 0.75, 1]),
    source("c", 3, [1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1]),
  ];
  const blue = `<effect id="blue-fx"><profile_COMMON><technique sid="standard"><lambert><diffuse>
    <color>0 0 1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>`;
  return faces(elements)
    .replace('<vertices id="vertices">', `${sources.join("")}$&`)
    .replace("</library_effects>", blue)
    .replace("</library_materials>", '<material id="blue" name="blue"><instance_effect url="#blue-fx"/></material>$&')
    .replace("</technique_common></bind_material>", '<instance_material symbol="blue" target="#blue"/>$&');
}

const input = (semantic: string, source: string, offset: number, set = "") =>
  `<input semantic="${semantic}" source="#${source}" offset="${offset}"${set && ` set="${set}"`}/>`;
const allInputs = [vertexInput, input("NORMAL", "n", 1), input("TEXCOORD", "uv", 2, "0"), input("COLOR", "c", 1)].join("");
/** Corner k of the cell 0: vertex, normal and colour, texture coordinates. */
const corner = (k: number) => [cells[0]![k]!, k, 3 - k].join(" ");
const corners = (...all: number[]) => all.map(corner).join(" ");

/** Of each primitive: its material, and the values of its corners by attribute. */
async function primitivesOf(content: string): Promise<{ left: readonly string[]; all: { material: string; of: object }[] }> {
  const { glb, left } = await converted(content);
  const document = readGltfDocument("a.glb", new Uint8Array(glb), new Map());
  const { meshes, materials } = document.json as any;
  const all = meshes[0].primitives.map(({ material, attributes, indices }: any) => {
    const numbers = (key: string) => [
      ...readNumbers(document, attributes[key], { NORMAL: 3, POSITION: 3, TEXCOORD_0: 2 }[key] ?? 3),
    ];
    const order = indices === undefined ? undefined : [...readNumbers(document, indices, 1)];
    const of = Object.fromEntries(
      Object.keys(attributes).map((key) => {
        const [values, width] = [numbers(key), key === "TEXCOORD_0" ? 2 : 3];
        return [key, order ? order.flatMap((v) => values.slice(v * width, v * width + width)) : values];
      }),
    );
    return { material: materials[material].name, of };
  });
  return { left, all };
}

describe("corners keep their normals, texture coordinates and colours, and faces their materials", () => {
  const triangles = (material: string, ...all: number[]) =>
    `<triangles count="${all.length / 3}" material="${material}">${allInputs}<p>${corners(...all)}</p></triangles>`;
  const other = (name: string, material: string, ...all: number[]) =>
    `<${name} count="1" material="${material}">${allInputs}<p>${corners(...all)}</p></${name}>`;

  it.each(["polygons", "trifans", "tristrips"])("in <%s>", async (name) => {
    const order = name === "tristrips" ? [0, 1, 3, 2] : [0, 1, 2, 3];
    const parted = { polygons: [0, 1, 3, 1, 2, 3], trifans: [0, 1, 2, 0, 2, 3], tristrips: [0, 1, 3, 1, 2, 3] }[name]!;
    const made = await primitivesOf(rich(other(name, "blue", ...order) + other(name, "red", ...order)));
    const wanted = await primitivesOf(rich(triangles("blue", ...parted) + triangles("red", ...parted)));
    expect(made.all.map(({ material }) => material)).toEqual(["blue", "red"]);
    expect(Object.keys(made.all[0]!.of)).toEqual(expect.arrayContaining(["NORMAL", "TEXCOORD_0", "COLOR_0"]));
    expect(made).toEqual(wanted);
  });

  it("also where the first has no material, which then is the usual one", async () => {
    const bare = other("polygons", "", 0, 1, 2).replace(' material=""', "");
    const { all } = await primitivesOf(rich(bare + other("polygons", "blue", 0, 1, 2) + other("polygons", "red", 0, 1, 2)));
    expect(all.map(({ material }) => material).slice(1)).toEqual(["blue", "red"]);
    expect(["blue", "red"]).not.toContain(all[0]!.material);
  });

  it.each([" ", "none-0"])("also where the file calls a material “%s”", async (name) => {
    const bare = other("polygons", "", 0, 1, 2).replace(' material=""', "");
    const text = rich(bare + other("polygons", name, 0, 1, 2)).replace('symbol="blue"', `symbol="${name}"`);
    expect((await primitivesOf(text)).all[1]!.material).toBe("blue");
    expect((await primitivesOf(text)).all[0]!.material).not.toBe("blue");
  });

  it("also beside elements without faces, which have none", async () => {
    const full = other("polygons", "red", 0, 1, 2, 3);
    const empty = ["triangles", "polygons"].map((name) => element(name, 0, name === "triangles" ? "<p/>" : "")).join("");
    expect(await primitivesOf(rich(empty + full))).toEqual(await primitivesOf(rich(full)));
    expect(await primitivesOf(rich(full + empty))).toEqual(await primitivesOf(rich(full)));
    const plain = triangles("red", 0, 1, 2);
    expect(await primitivesOf(rich(plain + element("triangles", 0, "<p/>")))).toEqual(await primitivesOf(rich(plain)));
  });

  it("unless only some faces have them, and then the page says so", async () => {
    const plain = `<trifans count="1">${vertexInput}<p>0 1 13</p></trifans>`;
    const made = await primitivesOf(rich(other("polygons", "red", 0, 1, 2, 3) + plain));
    expect(made.left).toEqual(["normals and colours that only some of its faces have", "textures"]);
    const keys = made.all.flatMap(({ of }) => Object.keys(of));
    expect(keys).not.toContain("NORMAL");
    expect(keys).not.toContain("COLOR_0");
    expect(made.all.map(({ of }) => (of as any).TEXCOORD_0?.length / 2)).toEqual(
      made.all.map(({ of }) => (of as any).POSITION.length / 3),
    );
    await meshOf(rich(other("polygons", "red", 0, 1, 2, 3) + plain));
  });
});

it("strips of a file that nobody made for this page are read as another program reads them", async () => {
  const sample = samplesOf(/^cube_tristrips\.dae$/)[0]!;
  const mesh = await meshOf(sample.bytes);
  expect(mesh.faces.length / 3).toBe(12); // so Assimp 5.2
  expect(areaOf(mesh)).toBeCloseTo(60000, 3);
  expect([Math.min(...mesh.positions), Math.max(...mesh.positions)]).toEqual([-50, 50]);
});
