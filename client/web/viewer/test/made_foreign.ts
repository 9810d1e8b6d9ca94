import { deflateSync } from "node:zlib";
import { strToU8, zipSync } from "three/addons/libs/fflate.module.js";

// A tube along z, of radius 1 and height 8, in the three formats, as small as each allows. Rows of `columns` vertices; the first row
// is at the origin.

export const [rows, columns] = [16, 12];

/** `rows` of faces, and one more of vertices. */
export function tubeOf(rows: number, columns: number) {
  const points = Array.from({ length: (rows + 1) * columns }, (_, k) => {
    const angle = (2 * Math.PI * (k % columns)) / columns;
    return [Math.cos(angle), Math.sin(angle), (8 * Math.floor(k / columns)) / rows];
  });
  const triangles = Array.from({ length: rows * columns }, (_, k) => {
    const row = Math.floor(k / columns) * columns;
    const [a, b] = [row + (k % columns), row + ((k + 1) % columns)];
    return [
      [a, b, b + columns],
      [a, b + columns, a + columns],
    ];
  }).flat();
  return { points, triangles };
}

const small = tubeOf(rows, columns);

/** COLLADA with z up, a colour, and a texture at an address on the net. */
export function makeDae({ points, triangles } = small): string {
  return `<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
  <library_images><image id="image" name="image"><init_from>http://textures.example/a.png</init_from></image></library_images>
  <library_effects><effect id="red-fx"><profile_COMMON>
    <newparam sid="surface"><surface type="2D"><init_from>image</init_from></surface></newparam>
    <newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
    <technique sid="standard"><lambert><diffuse><texture texture="sampler" texcoord="UV"/></diffuse></lambert></technique>
  </profile_COMMON></effect></library_effects>
  <library_materials><material id="red" name="red"><instance_effect url="#red-fx"/></material></library_materials>
  <library_geometries><geometry id="tube" name="tube"><mesh>
    <source id="places"><float_array id="numbers" count="${3 * points.length}">${points.flat().join(" ")}</float_array>
      <technique_common><accessor source="#numbers" count="${points.length}" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="vertices"><input semantic="POSITION" source="#places"/></vertices>
    <triangles count="${triangles.length}" material="red"><input semantic="VERTEX" source="#vertices" offset="0"/>
      <p>${triangles.flat().join(" ")}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene"><node id="node" name="pipe">
    <translate>0 0 5</translate>
    <instance_geometry url="#tube"><bind_material><technique_common>
      <instance_material symbol="red" target="#red"/>
    </technique_common></bind_material></instance_geometry>
  </node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>`;
}

/** The same with a DOCTYPE and prefixes, and the tube in strips, fans and polygons. */
export function makeOddDae(): string {
  const cell = (k: number) => {
    const row = Math.floor(k / columns) * columns;
    const [a, b] = [row + (k % columns), row + ((k + 1) % columns)];
    return [a, b, b + columns, a + columns];
  };
  const cells = Array.from({ length: rows * columns }, (_, k) => cell(k));
  const third = Math.floor(cells.length / 3);
  const lists = (all: readonly (readonly (number | undefined)[])[]) => all.map((one) => `<p>${one.join(" ")}</p>`).join("");
  const element = (name: string, all: readonly string[]) =>
    `<${name} count="${all.length}" material="red"><input semantic="VERTEX" source="#vertices" offset="0"/>${all.join("")}</${name}>`;
  const elements = [
    element(
      "tristrips",
      cells.slice(0, third).map(([a, b, c, d]) => lists([[d, a, c, b]])),
    ),
    element(
      "trifans",
      cells.slice(third, 2 * third).map((one) => lists([one])),
    ),
    element(
      "polygons",
      cells.slice(2 * third).map((one) => `<ph>${lists([one])}</ph>`),
    ),
  ].join("\n    ");
  const text = makeDae().replace(/<triangles[^]*<\/triangles>/, elements);
  const prefixed = text.replace(/<(\/?)(\w)/g, "<$1c:$2").replace(" xmlns=", " xmlns:c=");
  return prefixed.replace("?>\n", '?>\n<!DOCTYPE c:COLLADA SYSTEM "collada.dtd" [ <!ELEMENT a ANY> ]>\n');
}

/** FBX 7.4 as text, with y up: z of the tube is y of the file. */
export function makeFbx({ points, triangles } = small): string {
  const places = points.flatMap(([x, y, z]) => [x, z, -y!]);
  const corners = triangles.flatMap(([a, b, c]) => [a, b, -c! - 1]); // the last corner of each face is turned about
  return `; FBX 7.4.0 project file
FBXHeaderExtension:  {
	FBXHeaderVersion: 1003
	FBXVersion: 7400
}
GlobalSettings:  {
	Version: 1000
	Properties70:  {
		P: "UpAxis", "int", "Integer", "",1
		P: "UnitScaleFactor", "double", "Number", "",1
	}
}
Objects:  {
	Geometry: 1001, "Geometry::tube", "Mesh" {
		Vertices: *${places.length} {
			a: ${places.join(",")}
		}
		PolygonVertexIndex: *${corners.length} {
			a: ${corners.join(",")}
		}
		GeometryVersion: 124
	}
	Model: 1002, "Model::pipe", "Mesh" {
		Version: 232
		Properties70:  {
			P: "Lcl Translation", "Lcl Translation", "", "A",0,5,0
		}
	}
}
Connections:  {
	C: "OO",1002,0
	C: "OO",1001,1002
}
`;
}

/** A node of a binary FBX, with all that stands in it. */
interface Node {
  name: string;
  properties?: Buffer[];
  children?: Node[];
}

const number = (value: number) => Buffer.from(Uint32Array.of(value).buffer);
const textProperty = (text: string) => Buffer.concat([Buffer.from("S"), number(text.length), Buffer.from(text)]);
const idProperty = (id: number) => Buffer.concat([Buffer.from("L"), Buffer.from(BigInt64Array.of(BigInt(id)).buffer)]);

function arrayProperty(type: "b" | "d" | "i", items: Uint8Array | Float64Array | Int32Array): Buffer {
  const packed = deflateSync(new Uint8Array(items.buffer));
  return Buffer.concat([Buffer.from(type), number(items.length), number(1), number(packed.length), packed]);
}

function makeBinary(version: number, nodes: readonly Node[]): Buffer {
  const isLong = version >= 7500;
  const field = (value: number) => (isLong ? Buffer.from(BigUint64Array.of(BigInt(value)).buffer) : number(value));
  const nothing = Buffer.alloc(isLong ? 25 : 13);
  const node = ({ name, properties = [], children = [] }: Node, at: number): Buffer => {
    const own = Buffer.concat([Buffer.from([name.length]), Buffer.from(name), ...properties]);
    let inner = Buffer.alloc(0);
    const begin = at + nothing.length - 1 + own.length;
    for (const child of children) inner = Buffer.concat([inner, node(child, begin + inner.length)]);
    if (children.length > 0) inner = Buffer.concat([inner, nothing]);
    const sizes = [begin + inner.length, properties.length, Buffer.concat(properties).length];
    return Buffer.concat([...sizes.map(field), own, inner]);
  };
  let all = Buffer.concat([Buffer.from("Kaydara FBX Binary  \0\x1a\0"), number(version)]);
  for (const one of nodes) all = Buffer.concat([all, node(one, all.length)]);
  return Buffer.concat([all, Buffer.alloc(300)]);
}

/** A binary FBX of this version without a mesh: a node with a few properties, and one for each of `counts`, of packed truths. */
export function makeBinaryFbx(version: number, ...counts: number[]): Buffer {
  const odd = [textProperty("abc"), Buffer.from("C\x01"), Buffer.from("D12345678"), Buffer.from("R\0\0\0\0")];
  const truths = (count: number) => ({ name: "Truths", properties: [arrayProperty("b", new Uint8Array(count))] });
  return makeBinary(version, [{ name: "Objects", properties: odd }, ...counts.map(truths)]);
}

/** A layer of a geometry in binary: `part` has numbers. */
export function makeLayer(name: string, mapping: string, reference: string, part: string, numbers: readonly number[]): Node {
  const children = [
    { name: "MappingInformationType", properties: [textProperty(mapping)] },
    { name: "ReferenceInformationType", properties: [textProperty(reference)] },
    { name: part, properties: [arrayProperty("d", Float64Array.from(numbers))] },
  ];
  return { name, properties: [idProperty(0)], children };
}

/** A tube as in makeFbx(), in binary. */
export function makeBinaryTube(version: number, { points, triangles } = small, layers: readonly Node[] = []): Buffer {
  const places = Float64Array.from(points.flatMap(([x, y, z]) => [x!, z!, -y!]));
  const corners = Int32Array.from(triangles.flatMap(([a, b, c]) => [a!, b!, -c! - 1]));
  const called = (name: string) => textProperty(`${name}\0\x01Geometry`);
  const link = (part: number, owner: number) => ({
    name: "C",
    properties: [textProperty("OO"), idProperty(part), idProperty(owner)],
  });
  const more = Array.from({ length: 8 }, (_, k) => link(2000 + k, 0)); // links to nothing, so that the list is longer than a foot
  return makeBinary(version, [
    { name: "GlobalSettings", children: [{ name: "Version", properties: [idProperty(1000)] }] },
    {
      name: "Objects",
      children: [
        {
          name: "Geometry",
          properties: [idProperty(1001), called("tube"), textProperty("Mesh")],
          children: [
            { name: "Vertices", properties: [arrayProperty("d", places)] },
            { name: "PolygonVertexIndex", properties: [arrayProperty("i", corners)] },
            ...layers,
          ],
        },
        { name: "Model", properties: [idProperty(1002), called("pipe"), textProperty("Mesh")] },
      ],
    },
    { name: "Connections", children: [...more, link(1002, 0), link(1001, 1002)] },
  ]);
}

/** 3MF, which is a ZIP file. `padding`: bytes of zeros beside. */
export function make3mf(padding = 0, { points, triangles } = small): Uint8Array {
  const model = `<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
  <object id="1" type="model" name="pipe"><mesh>
    <vertices>${points.map(([x, y, z]) => `<vertex x="${x}" y="${y}" z="${z! + 5}"/>`).join("")}</vertices>
    <triangles>${triangles.map(([a, b, c]) => `<triangle v1="${a}" v2="${b}" v3="${c}"/>`).join("")}</triangles>
  </mesh></object></resources><build><item objectid="1"/></build></model>`;
  return zipSync({
    "[Content_Types].xml": strToU8(
      `<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>`,
    ),
    "_rels/.rels": strToU8(
      `<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship Target="/3D/model.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>`,
    ),
    "3D/model.model": strToU8(model),
    ...(padding > 0 && { "3D/zeros": new Uint8Array(padding) }),
  });
}
