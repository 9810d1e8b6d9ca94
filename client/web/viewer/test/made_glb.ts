import { boundsOf } from "../src/io/write_glb.js";
import { writeGlb } from "lpdeform-client/mesh/gltf_document";

const pixel = Uint8Array.from(
  atob("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="),
  (letter) => letter.charCodeAt(0),
);

/** Rows and columns of the tube that makeGlb makes. Its first row is the vertices 0 to columns. */
export const [rows, columns] = [16, 12];

/**
 * A GLB of a tube along y, of radius 0.5 and height 4, split where its texture begins again, with everything that a primitive can
 * have. Two nodes draw it, at twice the size and mirrored beside that. `isBare`: one node, and nothing but positions. `picture`: a PNG, its texture.
 */
export function makeGlb(isBare = false, picture: Uint8Array<ArrayBuffer> = pixel): Uint8Array<ArrayBuffer> {
  const [positions, normals, tangents, texture]: [number[], number[], number[], number[]] = [[], [], [], []];
  const [bend, weights, corners]: [number[], number[], number[]] = [[], [], []];
  for (let row = 0; row <= rows; ++row) {
    for (let column = 0; column <= columns; ++column) {
      const angle = (2 * Math.PI * (column % columns)) / columns;
      const [x, z] = [Math.cos(angle), Math.sin(angle)];
      positions.push(0.5 * x, (4 * row) / rows, 0.5 * z);
      normals.push(x, 0, z);
      tangents.push(-z, 0, x, -1);
      texture.push(column / columns, row / rows);
      bend.push(0.125, 0, 0);
      weights.push(1, 0, 0, 0);
      const at = row * (columns + 1) + column;
      const [above, next] = [at + columns + 1, at + 1];
      if (row < rows && column < columns) corners.push(at, above, next, next, above, above + 1);
    }
  }
  const pieces: Uint8Array[] = [];
  let size = 0;
  const views: object[] = [];
  const view = (bytes: Uint8Array) => {
    const begin = size;
    pieces.push(bytes, new Uint8Array((4 - (bytes.length % 4)) % 4));
    size += bytes.length + pieces.at(-1)!.length;
    return views.push({ buffer: 0, byteOffset: begin, byteLength: bytes.length }) - 1;
  };
  const bytesOf = ({ buffer }: { buffer: ArrayBufferLike }) => new Uint8Array(buffer);
  const accessors: object[] = [];
  const floats = (numbers: readonly number[], width: number, type = `VEC${width}`) => {
    const values = Float32Array.from(numbers);
    const bufferView = view(bytesOf(values));
    return (
      accessors.push({ bufferView, componentType: 5126, count: values.length / width, type, ...boundsOf(values, width) }) - 1
    );
  };
  const POSITION = floats(positions, 3);
  const count = positions.length / 3;
  const bare = { POSITION };
  const indices = () => {
    const bufferView = view(bytesOf(Uint16Array.from(corners)));
    return accessors.push({ bufferView, componentType: 5123, count: corners.length, type: "SCALAR" }) - 1;
  };
  let json: Record<string, unknown> = {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, name: "tube" }],
    meshes: [{ primitives: [{ attributes: bare, indices: indices() }] }],
  };
  if (!isBare) {
    const attributes = {
      ...bare,
      NORMAL: floats(normals, 3),
      TANGENT: floats(tangents, 4),
      TEXCOORD_0: floats(texture, 2),
      WEIGHTS_0: floats(weights, 4),
      JOINTS_0: accessors.push({ bufferView: view(new Uint8Array(4 * count)), componentType: 5121, count, type: "VEC4" }) - 1,
      _OWN: floats(bend, 3),
    };
    const primitive = { attributes, indices: indices(), material: 0, targets: [{ POSITION: floats(bend, 3) }] };
    const [input, output] = [floats([0, 1], 1, "SCALAR"), floats([0, 0, 0, 0, 1, 0], 3)];
    const image = view(picture);
    json = {
      asset: { version: "2.0", generator: "a test" },
      extensionsUsed: ["KHR_materials_unlit", "ACME_secret"],
      extensions: { ACME_secret: { keep: [1, 2.5, "me"] } },
      extras: { note: "an extra" },
      scene: 0,
      scenes: [{ nodes: [0, 1, 2, 3] }],
      nodes: [
        { mesh: 0, name: "tube", scale: [2, 2, 2] },
        { mesh: 0, name: "mirrored", translation: [5, 0, 0], scale: [-2, 2, 2] },
        { mesh: 1, skin: 0, name: "skinned" },
        { name: "joint", translation: [-5, 0, 0] },
      ],
      skins: [{ joints: [3] }],
      meshes: [
        { name: "sheet", weights: [0.5], primitives: [{ ...primitive, attributes: without(attributes, /JOINTS|WEIGHTS/) }] },
        { name: "skin", primitives: [primitive] },
      ],
      materials: [
        { name: "paper", pbrMetallicRoughness: { baseColorTexture: { index: 0 } }, extensions: { KHR_materials_unlit: {} } },
      ],
      textures: [{ source: 0 }],
      images: [{ bufferView: image, mimeType: "image/png" }],
      animations: [{ samplers: [{ input, output }], channels: [{ sampler: 0, target: { node: 0, path: "translation" } }] }],
    };
  }
  const buffer = new Uint8Array(size);
  let at = 0;
  for (const piece of pieces) {
    buffer.set(piece, at);
    at += piece.length;
  }
  return writeGlb({ json: { ...json, accessors, bufferViews: views, buffers: [{ byteLength: size }] }, buffer });
}

function without<Value>(object: Record<string, Value>, keys: RegExp): Record<string, Value> {
  return Object.fromEntries(Object.entries(object).filter(([key]) => !keys.test(key)));
}
