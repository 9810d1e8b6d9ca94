import { FileFault } from "lpdeform-client/mesh/fault";
import type { DaeMesh } from "./dae_faults.js";
import { type FaceInput, type Faces, isVertex } from "./dae_polygons.js";
import { triangulated } from "./triangulate.js";
import type { XmlText } from "./xml.js";

// The reader of three.js knows neither strips, fans nor holes, reads one of several <polygons>, and mixes up materials and attributes
// that only some elements of a mesh have. So they all become <triangles>. Corners keep their normals, texture coordinates and colours.

/** A page can handle no more. */
const mostTriangles = 5_000_000;
/** Of one polygon, and the sum of squares: the polygons of a file take some 5 seconds at most. */
const [mostCorners, mostWork] = [10_000, 5e8];
/** A polygon that crosses itself takes about so many times as long as another one. From `fewCorners` on this counts. */
const [crossingWork, fewCorners] = [10, 100];
/** A semantic of which the reader knows nothing. */
const unread = "NONE";

/** The file with triangles, and in words what some faces had that is left out, if anything. Throws a FileFault. */
export function withTriangles(
  name: string,
  text: string,
  meshes: readonly DaeMesh[],
): { text: string; left: string | undefined } {
  const left = new Set<string>();
  const pieces: string[] = [];
  const most = { triangles: mostTriangles, work: mostWork };
  let noMaterial: string | undefined;
  let end = 0;
  for (const mesh of meshes) {
    const filled = mesh.faces.filter(({ indices }) => indices.length > 0);
    const { kept, isLost } = keptKeys(filled, left);
    const materials = filled.map(({ element }) => element.attributes["material"]);
    const isPlain = mesh.faces.every(({ element }) => element.name === "triangles");
    const isAlike = materials.every(Boolean) || !materials.some(Boolean);
    const hasEmpty = filled.length < mesh.faces.length;
    if (isPlain && isAlike && !isLost && !hasEmpty) continue;
    if (!isAlike) noMaterial ??= unusedMaterial(mesh.xml);
    for (const faces of mesh.faces) {
      if (faces.element.at < end) continue; // it stands in other faces, where the reader does not look
      const corners = cornersOf(mesh, faces, most);
      if ((most.triangles -= corners.length / 3) < 0) {
        throw new FileFault(`${name} has more than ${mostTriangles} triangles, which this page takes at most.`);
      }
      pieces.push(text.slice(end, faces.element.at));
      if (corners.length > 0) pieces.push(trianglesOf(faces, corners, kept, isAlike ? undefined : noMaterial));
      end = faces.element.closed;
    }
  }
  pieces.push(text.slice(end));
  const words = [...left].join(", ").replace(/, (?=[^,]*$)/, " and ");
  return { text: pieces.join(""), left: left.size > 0 ? `${words} that only some of its faces have` : undefined };
}

/** A material that the file does not have: the reader gives the usual one. */
function unusedMaterial(xml: XmlText): string {
  const used = new Set<string | undefined>();
  for (const { attributes } of xml.tags()) used.add(attributes["symbol"]).add(attributes["material"]);
  let number = 0;
  while (used.has(`none-${number}`)) ++number;
  return `none-${number}`;
}

/** An attribute as the reader tells it from others. */
function keyOf({ element }: FaceInput): string {
  const { semantic = "", set } = element.attributes;
  const number = parseInt(set ?? "");
  return number > 0 ? `${semantic}${number}` : semantic;
}

const attributes: Readonly<Record<string, string>> = {
  NORMAL: "normals",
  COLOR: "colours",
  TEXCOORD: "texture coordinates",
  TEXCOORD1: "texture coordinates",
};

/** The attributes that all faces have, and whether others are lost. For texture coordinates the reader puts zeros, if it can. */
function keptKeys(all: readonly Faces[], left: Set<string>): { kept: Set<string>; isLost: boolean } {
  const kept = new Set<string>();
  let isLost = false;
  for (const key of ["NORMAL", "COLOR", "TEXCOORD1", "TEXCOORD"]) {
    const found = all.flatMap(({ inputs }) => inputs.findLast((input) => keyOf(input) === key) ?? []);
    if (found.length === 0) continue;
    const { stride } = found[0]!.source;
    const isFilled = key === "TEXCOORD" && stride === 2 && !kept.has("TEXCOORD1");
    if (found.every(({ source }) => source.stride === stride) && (isFilled || found.length === all.length)) kept.add(key);
    else {
      isLost = true;
      left.add(attributes[key]!);
    }
  }
  return { kept, isLost };
}

/** The corners of all triangles, as numbers among those of the element. */
function cornersOf({ xml, called, places }: DaeMesh, faces: Faces, most: { triangles: number; work: number }): number[] {
  const { element, kind, inputs, stride, indices, counts, holes, lists } = faces;
  if (!counts) return Array.from({ length: indices.length / stride }, (_, k) => k);
  const { offset } = inputs.find((input) => isVertex(input.element))!;
  const vertexOf = (corner: number) => indices[corner * stride + offset]!;
  const corners: number[] = [];
  let begin = 0;
  counts.forEach((count, item) => {
    const fault = (what: string) =>
      xml.fault(lists[item] ?? lists[0]!, `<${element.name}> of ${called} has a ${kind} ${item} ${what}`);
    if (kind !== "polygon") addStrip(begin, count, kind === "strip", vertexOf, corners);
    else if (count === 3) corners.push(begin, begin + 1, begin + 2);
    else {
      if (count > mostCorners) throw fault(`with ${count} corners; this page reads ${mostCorners} at most`);
      if (count > 4 && (most.work -= count ** 2) < 0) throw fault("after so many large ones that reading them takes too long");
      const points: number[] = [];
      for (let k = begin; k < begin + count; ++k) for (let n = 0; n < 3; ++n) points.push(places[3 * vertexOf(k) + n]!);
      const found = triangulated(points, holes.get(item) ?? [count]);
      if (!found) throw fault("with a hole that does not lie within its outline, or crosses it or another hole");
      if (count > fewCorners && isFan(found)) most.work -= (crossingWork - 1) * count ** 2;
      for (const corner of found) corners.push(begin + corner);
    }
    begin += count;
  });
  return corners;
}

/** So a polygon is parted that crosses itself. */
const isFan = (triangles: readonly number[]) => triangles.every((corner, k) => k % 3 > 0 || corner === 0);

/** Without the triangles of two corners that join strips. */
function addStrip(
  begin: number,
  count: number,
  isStrip: boolean,
  vertexOf: (corner: number) => number,
  corners: number[],
): void {
  for (let k = 0; k + 2 < count; ++k) {
    const [a, b, c] = [begin + (isStrip ? k : 0), begin + k + 1, begin + k + 2];
    const [p, q, r] = [vertexOf(a), vertexOf(b), vertexOf(c)];
    if (p === q || q === r || r === p) continue;
    if (isStrip && k % 2 === 1) corners.push(a, c, b);
    else corners.push(a, b, c);
  }
}

function trianglesOf(faces: Faces, corners: readonly number[], kept: Set<string>, none: string | undefined): string {
  const { element, inputs, stride, indices } = faces;
  const material = element.attributes["material"] || none;
  let numbers = "";
  for (const corner of corners) {
    for (let k = corner * stride; k < (corner + 1) * stride; ++k) numbers += `${indices[k]} `;
  }
  const all = inputs.map((input) => {
    const { semantic = "", source = "", set } = input.element.attributes;
    const isRead = isVertex(input.element) || kept.has(keyOf(input));
    const own = [attributeOf("semantic", isRead ? semantic : unread), attributeOf("source", source)];
    return `<input${own.join("")} offset="${input.offset}"${set === undefined ? "" : attributeOf("set", set)}/>`;
  });
  const begin = `<triangles count="${corners.length / 3}"${material === undefined ? "" : attributeOf("material", material)}>`;
  return `${begin}${all.join("")}<p>${numbers}</p></triangles>`;
}

const attributeOf = (name: string, value: string) =>
  ` ${name}="${value.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;")}"`;
