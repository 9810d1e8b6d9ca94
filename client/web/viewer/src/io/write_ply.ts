import { polygonsOf, type WrittenMesh } from "lpdeform-client/mesh/mesh";
import { colourIn, type PaletteName } from "../model/palettes.js";

/**
 * Binary, with the distortion and a colour of each vertex. `red`: the distortion that is drawn in full red. Numbers are float
 * or double, as given.
 */
export function writePly(
  { positions, faces, corners }: WrittenMesh,
  distortion: Float32Array | Float64Array,
  red: number,
  palette: PaletteName = "blueToRed",
): Uint8Array<ArrayBuffer> {
  const isDouble = positions instanceof Float64Array;
  const size = isDouble ? 8 : 4;
  const vertexBytes = 4 * size + 3;
  const vertexCount = positions.length / 3;
  const faceCount = corners?.length ?? faces.length / 3;
  const cornerCount = corners?.reduce((sum, count) => sum + count, 0) ?? faces.length;
  const isLong = corners?.some((count) => count > 255) ?? false;
  const header = new TextEncoder().encode(
    [
      "ply",
      "format binary_little_endian 1.0",
      `element vertex ${vertexCount}`,
      ...["x", "y", "z", "distortion"].map((property) => `property ${isDouble ? "double" : "float"} ${property}`),
      ...["red", "green", "blue"].map((property) => `property uchar ${property}`),
      `element face ${faceCount}`,
      `property list ${isLong ? "uint" : "uchar"} int vertex_indices`,
      "end_header",
      "",
    ].join("\n"),
  );
  const bytes = new Uint8Array(header.length + vertexBytes * vertexCount + (isLong ? 4 : 1) * faceCount + 4 * cornerCount);
  bytes.set(header);
  const view = new DataView(bytes.buffer);
  let at = header.length;
  const set = (at: number, value: number) => (isDouble ? view.setFloat64(at, value, true) : view.setFloat32(at, value, true));
  for (let v = 0; v < vertexCount; ++v, at += vertexBytes) {
    const value = distortion[v] ?? 0;
    for (let axis = 0; axis < 3; ++axis) set(at + size * axis, positions[3 * v + axis]!);
    set(at + 3 * size, value);
    colourIn(palette, red > 0 ? value / red : 0).forEach((channel, k) => view.setUint8(at + 4 * size + k, channel));
  }
  for (const polygon of polygonsOf({ faces, ...(corners && { corners }) })) {
    if (isLong) view.setUint32(at, polygon.length, true);
    else view.setUint8(at, polygon.length);
    at += isLong ? 4 : 1;
    for (const vertex of polygon) {
      view.setInt32(at, vertex, true);
      at += 4;
    }
  }
  return bytes;
}
