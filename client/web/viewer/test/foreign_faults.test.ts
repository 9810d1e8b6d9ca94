import "./foreign_in_node.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { parseMesh } from "lpdeform-client/mesh/read";
import { strToU8, unzipSync, zipSync } from "three/addons/libs/fflate.module.js";
import { expect, it } from "vitest";
import { glbIn } from "../src/io/foreign_glb.js";
import { make3mf, makeBinaryTube, makeDae, makeFbx, makeLayer } from "./made_foreign.js";

// Files as broken exporters and downloads leave them: each refusal names the element as the file counts it, and nothing that is wrong
// is opened.

type Content = string | Uint8Array;

const [dae, fbx, tube, binary] = [makeDae(), makeFbx(), make3mf(), makeBinaryTube(7400)];
const unlinked = Buffer.from(binary.toString("latin1").replaceAll("\x02\0\0\0OO", "\x02\0\0\0OP"), "latin1");
const [corners] = [204]; // of the tube

/** The file with another piece, which must stand in it. */
function but(text: string, piece: string | RegExp, other: string): string {
  const changed = text.replace(piece, other);
  expect(changed).not.toBe(text);
  return changed;
}

/** A 3MF whose model is changed. */
function model(piece: string | RegExp, other: string): Uint8Array {
  return parts((all) => {
    all["3D/model.model"] = strToU8(but(new TextDecoder().decode(all["3D/model.model"]), piece, other));
  });
}

function parts(change: (all: Record<string, Uint8Array>) => void): Uint8Array {
  const all = unzipSync(tube);
  change(all);
  return zipSync(all);
}

const faces = (element: string) => but(dae, /<triangles[^]*<\/triangles>/, element);
const vertexInput = '<input semantic="VERTEX" source="#vertices" offset="0"/>';
const extra = '<extra><technique profile="a"><scale>1</scale><input type="bool">1</input><skin>a</skin></technique></extra>';
const physics = `<library_geometries><geometry id="hull"><convex_mesh convex_hull_of="#tube"/></geometry></library_geometries>
<library_physics_models><physics_model id="body"><rigid_body sid="a"><technique_common><shape>
  <instance_geometry url="#hull"/><translate>0</translate>
</shape></technique_common></rigid_body></physics_model></library_physics_models>
<library_physics_scenes><physics_scene id="world"><instance_node url="#away"/></physics_scene></library_physics_scenes>`;
const placesOf = (file: string) => /<float_array[^>]*>([^<]*)/.exec(file)![1]!;
const group = '<basematerials id="5"><base name="a" displaycolor="#ff0000"/></basematerials><object';

const converted = (name: string, content: Content) => glbIn(new File([content as Uint8Array<ArrayBuffer>], name));

async function expectRefused(name: string, content: Content, words: string): Promise<void> {
  const thrown = await converted(name, content).catch((error: unknown) => error);
  expect(thrown).toBeInstanceOf(FileFault);
  expect((thrown as FileFault).message).toContain(words);
  expect((thrown as FileFault).message.startsWith(name)).toBe(true);
}

it.each<[string, Content, number]>([
  ["a.dae", dae, 384],
  ["a.fbx", fbx, 384],
  ["a.3mf", tube, 384],
  ["a.fbx", binary, 384],
  ["a.fbx", makeBinaryTube(7500), 384],
  ["a.dae", faces(`<polylist count="2">${vertexInput}<vcount>3 4</vcount><p>0 1 13 1 2 14 13</p></polylist>`), 3],
  ["a.dae", faces(`<polygons count="1">${vertexInput}<p>0 1 13 12</p></polygons>`), 2],
  ["a.dae", faces(`<polygons count="2">${vertexInput}<p>0 1 2</p><p>3 4 5 6</p></polygons>`), 3],
  ["a.dae", `<!-- <a> > -->${but(dae, /^.*\n/, "").replace("<mesh>", "<mesh><![CDATA[<b>]]>")}`, 384],
  ["a.dae", but(dae, 'id="node"', 'id="tube"'), 384],
  ["a.dae", but(dae, 'id="node"', 'id="red-fx"'), 384],
  ["a.dae", but(dae, "</node>", `${extra}</node>`), 384],
  ["a.dae", but(dae, "<library_visual_scenes>", `${physics}<library_visual_scenes>`), 384],
  ["a.dae", but(dae, /<p>(.*)<\/p>/, "<p><![CDATA[$1]]></p>"), 384],
  ["a.dae", but(dae, /<p>(.*) (.*)<\/p>/, "<p><?a b?>$1<?a b?> <!-- 7 -->&#13;&#xD;\n<![CDATA[$2]]></p>"), 384],
  ["a.dae", but(dae, '"VERTEX" source="#vertices"', '"&#86;ERTEX" source="&#x23;vertices"'), 384],
  ["a.dae", but(dae, 'id="tube"', 'id="a&#x62;&amp;c"').replace("#tube", "#ab&#38;c"), 384],
  ["a.3mf", model("<object", group), 384],
])("%s is opened whole (%#)", async (name, content, faceCount) => {
  const { glb } = await converted(name, content);
  expect(parseMesh("a.glb", new Uint8Array(glb)).faces.length / 3).toBe(faceCount);
});

it.each<[Content, string]>([
  [dae.slice(0, 300), " ends too soon: <COLLADA> of line 2 has no end."],
  [dae.slice(0, 3000), " ends too soon: <float_array> of line 12 has no end."],
  [dae.slice(0, -12), " ends too soon: the tag of line 26 has no end."],
  [`${dae}<b/>`, ", line 27: <b> comes after the end of the XML."],
  [but(dae, "</mesh>", "</mash>"), ", line 19: </mash> ends <mesh> of line 11."],
  [but(dae, 'name="pipe"', 'name="a < b"'), ", line 20: the tag that begins here is broken."],
  ["hello", " has no XML element."],
  ["<html><body><p>404</p></body></html>", ", line 1: the file begins with <html>, and COLLADA with <COLLADA>."],
  [but(dae, /<asset>.*<\/asset>/, ""), ", line 2: <COLLADA> has no <asset>."],
  [but(dae, /<scene>.*<\/scene>/, ""), ", line 2: <COLLADA> has no <scene>."],
  [but(dae, "<p>0 1 13", "<p>0 1 999"), ", line 18: <triangles> of the geometry “tube” has a polygon 0 with vertex 999;"],
  [but(dae, "<p>0 1 13", "<p>0 x 13"), ", line 18: <p> has “x”, which is no whole number from 0."],
  [but(dae, "<p>0 1 13", "<p>0 -1 13"), ", line 18: <p> has “-1”, which is no whole number from 0."],
  [but(dae, "<p>0 1 13", "<p>0 &#x110000; 13"), ", line 18: <p> has “&#x110000;”, which is no whole number from 0."],
  [but(dae, "<p>0 1 13", "<p>0 1&own;13"), ", line 18: <p> has “1&own;13”, which is no whole number from 0."],
  [but(dae, "<p>0 1 13", "<p>0 1.5 13"), ", line 18: <p> has “1.5”, which is no whole number from 0."],
  [
    but(dae, "<p>0 1 13 ", "<p>0 1 "),
    ", line 18: <triangles> of the geometry “tube” has 384 polygons, for which <p> needs 1152",
  ],
  [but(dae, 'count="384"', 'count="380"'), ", line 18: <triangles> of the geometry “tube” has 380 polygons, for which <p>"],
  [but(dae, 'count="384"', 'count="many"'), ", line 17: <triangles> of the geometry “tube” has the count “many”."],
  [but(dae, 'count="384"', 'count="999999999999"'), ", line 18: <triangles> of the geometry “tube” has 999999999999 polygons"],
  [
    but(dae, placesOf(dae), placesOf(dae).replaceAll(".", ",")),
    ", line 12: vertex 1 of the <float_array> “numbers” has “0,866",
  ],
  [but(dae, ">1 0 0", ">NaN 0 0"), ", line 12: vertex 0 of the <float_array> “numbers” has “NaN”, which is no finite"],
  [but(dae, ">1 0 0 ", ">"), ", line 12: the <float_array> “numbers” says that it has 612 numbers, and has 609."],
  [but(dae, 'source="#places"', 'source="#nowhere"'), ", line 16: the input POSITION names “#nowhere”, which is no <source>"],
  [but(dae, 'source="#vertices"', 'source="#numbers"'), ", line 17: <triangles> of the geometry “tube” names “#numbers”"],
  [but(dae, /<vertices.*<\/vertices>/, ""), ", line 11: the geometry “tube” has no <vertices> with a POSITION."],
  [but(dae, ' stride="3"', ""), ", line 13: the places “places” have the stride 1 and the offset 0; this page reads 3 and 0."],
  [but(dae, "<p>", '<input semantic="NORMAL" source="#n" offset="0"/><p>'), ", line 18: the input NORMAL names “#n”, which"],
  [but(dae, 'offset="0"', ""), ", line 17: <triangles> of the geometry “tube” has an input VERTEX with the offset “”."],
  [but(dae, "#tube", "#tubes"), ", line 22: <instance_geometry> names “#tubes”, which is no <geometry> of the file."],
  [but(dae, "#scene", "#node"), ", line 26: <instance_visual_scene> names “#node”, which is no <visual_scene> of the file."],
  [but(dae, "#red-fx", "other.dae#fx"), ", line 10: <instance_effect> names “other.dae#fx”, which is no <effect>"],
  [but(dae, /<mesh>[^]*<\/mesh>/, "<spline/>"), ", line 11: the geometry “tube” has a <spline> in place of a <mesh>."],
  [dae.replaceAll("triangles", "lines"), " has no triangles, only the lines “pipe”."],
  [
    faces(`<polylist count="2">${vertexInput}<vcount>2 4</vcount><p>0 1 1 2 14 13</p></polylist>`),
    " a polygon 0 with 2 corners.",
  ],
  [
    faces(`<polylist count="2">${vertexInput}<vcount>3 3</vcount><p>0 1 13 1 2 14 9</p></polylist>`),
    " needs 6 numbers; it has 7.",
  ],
  [faces(`<polylist count="2">${vertexInput}<vcount>3</vcount><p>0 1 13</p></polylist>`), " it has 2 polygons, and has 1."],
  [
    faces(`<polylist count="1">${vertexInput}<vcount>3</vcount>\n<ph><p>0 1 2</p></ph></polylist>`),
    ", line 18: <polylist> of the geometry “tube” has a polygon with holes (<ph>), which only <polygons> can have.",
  ],
  [
    faces(`<polylist count="2">${vertexInput}<vcount>3 4</vcount><p>0 1 13 1 2 204 13</p></polylist>`),
    `, line 17: <polylist> of the geometry “tube” has a polygon 1 with vertex ${corners}; there are ${corners}, counted from 0.`,
  ],
  [but(dae, "<translate>0 0 5", "<translate>0 0,5 5"), ", line 21: <translate> has “0,5”, which is no number."],
  [but(dae, "<translate>0 0 5", "<translate>0 5"), ", line 21: <translate> has 2 numbers in place of 3."],
  [but(dae, 'meter="1"', 'meter="0,0254"'), ", line 3: <unit> has the size “0,0254”, which is no number above 0."],
  [but(dae, /<geometry [^]*<\/geometry>/, "").replace(/<instance_geometry[^]*<\/instance_geometry>/, ""), " has no triangles."],
])("a broken COLLADA file is refused by its line (%#)", async (content, words) => {
  await expectRefused("a.dae", content, words);
});

it("copies that double at each level are refused", async () => {
  const levels = (count: number, level: (k: number) => string) =>
    Array.from({ length: count }, (_, k) => level(k + 1)).join("\n");
  const nodes = (count: number) => {
    const twice = (k: number) => `<instance_node url="#n${k}"/><instance_node url="#n${k}"/>`;
    const made = levels(count, (k) => `<node id="n${k}">${twice(k - 1)}</node>`);
    const library = `<library_nodes><node id="n0"/>\n${made}</library_nodes>`;
    const all = but(dae, "<library_visual_scenes>", `${library}<library_visual_scenes>`);
    return but(all, "</bind_material></instance_geometry>", `$&<instance_node url="#n${count}"/>`);
  };
  await converted("a.dae", nodes(8));
  const end = "and all its parts, more than 100000 copies are made; that is the limit for a file.";
  await expectRefused("a.dae", nodes(60), `a.dae, line 35: with the node “n14” ${end}`);
  await expectRefused(
    "a.dae",
    but(dae, "<translate>0", '<instance_node url="#node"/>$&'),
    ": the node “node” is a part of itself.",
  );
  const objects = (count: number) => {
    const twice = (k: number) => `<component objectid="${k}"/><component objectid="${k}"/>`;
    const made = levels(count, (k) => `<object id="${k + 1}"><components>${twice(k)}</components></object>`);
    return model("</resources>", `\n${made}</resources>`);
  };
  await converted("a.3mf", objects(8));
  await expectRefused("a.3mf", objects(60), `a.3mf, 3D/model.model, line 21: with the object “15” ${end}`);
});

it("the time to refuse a long tag grows no faster than the tag", async () => {
  const long = "a".repeat(200_000);
  await expectRefused("a.dae", `<${long}<`, " ends too soon: the tag of line 1 has no end.");
  await expectRefused("a.dae", `<COLLADA ${long}/>`, ", line 1: <COLLADA> has no <asset>.");
});

const objects = (piece: string) => but(fbx, "\t\tGeometryVersion: 124\n", `\t\tGeometryVersion: 124\n${piece}`);

it.each<[Content, string]>([
  [fbx.slice(0, 4000), " ends too soon: “Vertices: *612” of line 15 has no end."],
  [fbx.slice(0, 12_000), " ends too soon: “PolygonVertexIndex: *1152” of line 18 has no end."],
  [but(fbx, /\tC: "OO",1001[^]*/, ""), " ends too soon: “Connections:” of line 30 has no end."],
  [`${fbx}}\n`, ", line 34: this } ends nothing."],
  [
    but(fbx, "a: 0,1,-14", "a: 0,999,-14"),
    ", line 18: the geometry 1001 “tube” has a polygon 0 with vertex 999; there are 204,",
  ],
  [
    but(fbx, "a: 0,1,-14", "a: 0,1,-1000"),
    ", line 18: the geometry 1001 “tube” has a polygon 0 with vertex 999; there are 204,",
  ],
  [but(fbx, "a: 0,1,-14", "a: 0,x,-14"), ", line 18: the geometry 1001 “tube” has a polygon 0 with a corner that is no whole"],
  [but(fbx, "a: 0,1,-14,", "a: 0,-2,-14,"), " has a polygon 0 with 2 corners."],
  [but(fbx, "a: 0,1,-14,", "a: 0,1,"), " says that its PolygonVertexIndex are 1152 numbers, and has 1151."],
  [
    but(fbx, /-(\d+)(\n\t\t}\n\t\tGeometryVersion)/, "1$2"),
    ", line 18: the geometry 1001 “tube” has a polygon 383 without an end.",
  ],
  [but(fbx, "a: 1,0,", "a: nan,0,"), ", line 15: the geometry 1001 “tube” has a vertex 0 without three finite numbers."],
  [but(fbx, "a: 1,0,", "a: 1.#IND,0,"), ", line 15: the geometry 1001 “tube” has a vertex 0 without three finite numbers."],
  [but(fbx, "*612", "*615"), ", line 15: the geometry 1001 “tube” says that its Vertices are 615 numbers, and has 612."],
  [but(fbx, "*612", "*611").replace("a: 1,0,", "a: 1,"), " has 611 numbers for its Vertices, which is no multiple of 3."],
  [but(fbx, /\t\tVertices[^}]*}\n/, ""), " has a polygon 0 with vertex 0; there are 0, counted from 0."],
  [but(fbx, /\t\tPolygonVertexIndex[^}]*}\n/, ""), ", line 14: the geometry 1001 “tube” has no polygons (PolygonVertexIndex)."],
  [
    but(fbx, '\tC: "OO",1001,1002\n', ""),
    ", line 14: the geometry 1001 “tube” belongs to no model: the connections name none.",
  ],
  [
    but(fbx, /\tModel: [^]*?\n\t}\n/, ""),
    ", line 14: the geometry 1001 “tube” belongs to no model: the connections name none.",
  ],
  [but(fbx, /\tGeometry: [^]*?\n\t}\n/, ""), " has no Geometry, so there is nothing to show."],
  [but(fbx, '"A",0,5,0', '"A",nan,5,0'), ": “pipe” has a place, a turn or a size that is no finite number."],
  [fbx.replaceAll("\t", "  "), ", line 14: “Geometry” is not indented by one tab, as this page wants it."],
  [but(fbx, "FBXVersion: 7400", "FBXVersion: 6100"), ": FBX version not supported, FileVersion: 6100."],
  ["hello", ": Cannot find the version number for the file given."],
  [makeBinaryTube(6100), ": FBX version not supported, FileVersion: 6100."],
  [binary.map((byte) => byte || 32), ": byte 20 is 32 in place of 0; the file was changed as if it were text."],
  [binary.subarray(0, 1500), " ends too soon, in or after its node “PolygonVertexIndex” at byte 813: it has 1500"],
  [binary.subarray(0, binary.length - 310), " ends too soon, in or after its node “C” at byte"],
  [unlinked, ": the geometry 1001 “tube” belongs to no model: the connections name none."],
])("a broken FBX file is refused by its geometry (%#)", async (content, words) => {
  await expectRefused("a.fbx", content, words);
});

it("a broken FBX file in binary is refused by its geometry and polygon", async () => {
  const all = { points: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles: [[0, 1, 2], [0, 2, 7]] }; // prettier-ignore
  const wrong = " “tube” has a polygon 1 with vertex 7; there are 3, counted from 0.";
  await expectRefused("a.fbx", makeBinaryTube(7400, all), `a.fbx: the geometry 1001${wrong}`);
  await expectRefused("a.fbx", makeBinaryTube(7500, all), `a.fbx: the geometry 1001${wrong}`);
  all.points[1]![1] = Infinity;
  await expectRefused("a.fbx", makeBinaryTube(7400, all), "has a vertex 1 without three finite numbers.");
  const damaged = Uint8Array.from(binary);
  damaged.fill(255, 300, 330);
  await expectRefused("a.fbx", damaged, "a.fbx: the Vertices of the geometry 1001 “tube” at byte");
});

it("a binary FBX file is opened whole however long its foot is", async () => {
  for (const whole of [binary, makeBinaryTube(7500)]) {
    for (let cut = 0; cut <= 300; cut += 5) await converted("a.fbx", whole.subarray(0, whole.length - cut));
  }
});

it("a layer without what it needs is named", async () => {
  const layer = (name: string, lines: string) => objects(`\t\t${name}: 0 {\n${lines}\t\t}\n`);
  const indexed = '\t\t\tReferenceInformationType: "IndexToDirect"\n\t\t\tColors: *4 {\n\t\t\t\ta: 1,1,1,1\n\t\t\t}\n';
  const wrong = "a.fbx, line 22: the geometry 1001 “tube” has a ";
  await expectRefused("a.fbx", layer("LayerElementColor", indexed), `${wrong}LayerElementColor without ColorIndex.`);
  await expectRefused("a.fbx", layer("LayerElementNormal", ""), `${wrong}LayerElementNormal without Normals.`);
  const none = '\t\t\tMappingInformationType: "NoMappingInformation"\n';
  expect((await converted("a.fbx", layer("LayerElementMaterial", none))).left).toEqual([]);
});

it("the ways of a layer that the reader does not know are its own", async () => {
  const uv = Array.from({ length: 408 }, (_, k) => k / 408);
  type Layer = Parameters<typeof makeLayer>;
  const layer = ([name, mapping, reference, part, numbers]: Layer) => `\t\t${name}: 0 {
\t\t\tMappingInformationType: "${mapping}"
\t\t\tReferenceInformationType: "${reference}"
\t\t\t${part}: *${numbers.length} {
\t\t\t\ta: ${numbers.join(",")}
\t\t\t}
\t\t}
`;
  for (const name of ["PolygonGroup", "Smoothing", "Texture"]) {
    const layers: Layer[] = [
      ["LayerElementUV", "ByVertice", "Direct", "UV", uv],
      [`LayerElement${name}`, "ByPolygon", "IndexToDirect", name, [0]],
    ];
    await converted("a.fbx", objects(layers.map(layer).join("")));
    const made = layers.map((one) => makeLayer(...one));
    await converted("a.fbx", makeBinaryTube(7400, undefined, made));
  }
});

it("normals that are no numbers are left out, and the page says so", async () => {
  const normals = `\t\tLayerElementNormal: 0 {
\t\t\tMappingInformationType: "ByPolygonVertex"
\t\t\tReferenceInformationType: "Direct"
\t\t\tNormals: *6 {
\t\t\t\ta: 0,0,1,0,0,1
\t\t\t}
\t\t}
`;
  const { glb, left } = await converted("a.fbx", objects(normals));
  expect(left).toEqual(["normals that are no numbers"]);
  expect(new TextDecoder().decode(glb)).not.toContain("NORMAL");
});

it.each<[Content, string]>([
  [tube.slice(0, 2000), ": the end of a ZIP file, where its parts are listed, is missing or damaged."],
  ["hello", ": the end of a ZIP file, where its parts are listed, is missing or damaged."],
  [Uint8Array.from(tube).fill(255, 1500, 1600), ": its part “3D/model.model” is damaged."],
  [parts((all) => delete all["3D/model.model"]), " has no model, which is a part such as “3D/3dmodel.model”."],
  [parts((all) => delete all["_rels/.rels"]), " has no part “_rels/.rels”."],
  [
    parts((all) => {
      all["3D/other.model"] = all["3D/model.model"]!;
      delete all["3D/model.model"];
    }),
    ", _rels/.rels, line 1: <Relationship> names the part “/3D/model.model”, which is not in the file.",
  ],
  [parts((all) => (all["_rels/.rels"] = strToU8("<Relationships/>"))), ", _rels/.rels names no model."],
  [
    parts((all) => (all["3D/model.model"] = all["3D/model.model"]!.slice(0, 5000))),
    ", 3D/model.model ends too soon: the tag of line 4 has no end.",
  ],
  [
    parts((all) => (all["3D/Objects/a.model"] = all["3D/model.model"]!)),
    ": the object “1” is in the file twice, the other time in",
  ],
  [
    parts((all) => (all["3D/model.model"] = strToU8("<html/>"))),
    ", 3D/model.model, line 1: the part begins with <html>, and a",
  ],
  [
    model('v2="1" v3="13"', 'v2="999" v3="13"'),
    ", 3D/model.model, line 5: triangle 0 of the object “1” has vertex 999; there are 204,",
  ],
  [
    model('v2="1" v3="13"', 'v2="-1" v3="13"'),
    ", 3D/model.model, line 5: triangle 0 of the object “1” has the v2 “-1”, which is no",
  ],
  [
    model('v2="1" v3="13"', 'v2="1"'),
    ", 3D/model.model, line 5: triangle 0 of the object “1” has the v3 “”, which is no vertex.",
  ],
  [
    model('z="5"', 'z="5,5"'),
    ", 3D/model.model, line 4: vertex 0 of the object “1” has “1”, “0” and “5,5”, which are not three",
  ],
  [
    model('z="5"', 'z="NaN"'),
    ", line 4: vertex 0 of the object “1” has “1”, “0” and “NaN”, which are not three finite numbers.",
  ],
  [model(' z="5"', ""), ", line 4: vertex 0 of the object “1” has “1”, “0” and “”, which are not three finite numbers."],
  [model('objectid="1"', 'objectid="7"'), ", 3D/model.model, line 6: <item> names the object “7”, which is not in the file."],
  [model('<item objectid="1"/>', ""), ", 3D/model.model has no <item> in its <build>: nothing is made."],
  [model(/<build>.*<\/build>/, ""), ", 3D/model.model has no <build>, which says what is made."],
  [model(/<mesh>[^]*<\/mesh>/, ""), ", 3D/model.model, line 3: the object “1” has neither a <mesh> nor <components>."],
  [model(/<triangles>[^]*<\/triangles>/, "<triangles/>"), " has no triangles."],
  [model('objectid="1"', 'objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0"'), ", line 6: <item> has the transform “1 0 0 0 1 0"],
  [model('objectid="1"', 'objectid="1" transform="1 0 0  0 1 0 0 0 1 0 0 0"'), ", which is not 12 numbers with one blank"],
  [
    model("</resources>", '<object id="2"><components><component objectid="8"/></components></object></resources>'),
    " object “8”",
  ],
  [
    model("</resources>", '<object id="2"><components><component objectid="2"/></components></object></resources>'),
    ", 3D/model.model, line 6: the object “2” is a part of itself.",
  ],
  [
    model("</resources>", '<object id="1"><mesh/></object></resources>'),
    ", line 6: the object “1” is in the file twice, the other",
  ],
  [
    model("</mesh>", '</mesh>\n<object id="2"><mesh/></object>'),
    ", line 7: the object “2” stands in the object “1” of line 3.",
  ],
  [model('name="pipe"', 'name="pipe" pid="9"'), ", line 3: the object “1” names the group “9”, which is no <basematerials>"],
  [
    model("<object", group.replace("<object", '<object pid="5" pindex="7"')),
    " names entry 7 of the group “5”; there are 1, counted",
  ],
  [
    model(/<object([^]*?)<triangle v/, `${group}$1<triangle pid="5" p1="0" v`),
    ": triangle 1 of the object “1” has no pid, nor has",
  ],
])("a broken 3MF file is refused by its part (%#)", async (content, words) => {
  await expectRefused("a.3mf", content, words);
});
