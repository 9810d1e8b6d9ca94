import type { Mesh } from "./mesh.js";
import { MeshBuilder } from "./builder.js";
import { FileFault } from "./fault.js";

/** STL as text or binary. Corners at exactly the same place become one vertex. */
export function readStl(name: string, bytes: Uint8Array): Mesh {
  const welder = new Welder(name);
  if (isBinary(bytes)) readBinary(name, bytes, welder);
  else readText(bytes, welder);
  return welder.builder.finish(name);
}

function isBinary(bytes: Uint8Array): boolean {
  if (bytes.length < 84) return false;
  const count = new DataView(bytes.buffer, bytes.byteOffset).getUint32(80, true);
  if (bytes.length === 84 + 50 * count) return true;
  return new TextDecoder("latin1").decode(bytes.subarray(0, 5)) !== "solid";
}

function readBinary(name: string, bytes: Uint8Array, welder: Welder): void {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const count = view.getUint32(80, true);
  if (bytes.length < 84 + 50 * count)
    throw new FileFault(`${name} has ${count} triangles by its header and ends too soon.`);
  for (let f = 0; f < count; ++f) {
    if (view.getUint16(84 + 50 * f + 48, true) !== 0) welder.builder.leftAside("attributes of triangles");
    for (let number = 3; number < 12; number += 3) {
      const at = 84 + 50 * f + 4 * number;
      welder.corner(view.getFloat32(at, true), view.getFloat32(at + 4, true), view.getFloat32(at + 8, true));
    }
  }
}

function readText(bytes: Uint8Array, welder: Welder): void {
  const text = new TextDecoder().decode(bytes);
  if ((text.match(/^\s*solid\b/gm) ?? []).length > 1) welder.builder.leftAside("solids");
  const vertex = /vertex\s+(\S+)\s+(\S+)\s+(\S+)/g;
  for (const { index, 1: x, 2: y, 3: z } of text.matchAll(vertex)) {
    welder.corner(Number(x), Number(y), Number(z), () => `, line ${text.slice(0, index).split("\n").length}`);
  }
  welder.end();
}

class Welder {
  readonly builder = new MeshBuilder();
  readonly #known = new Map<string, number>();
  #face: number[] = [];

  constructor(readonly name: string) {}

  corner(x: number, y: number, z: number, place = () => ""): void {
    const key = `${x + 0} ${y + 0} ${z + 0}`; // + 0: -0 and 0 are the same place
    let vertex = this.#known.get(key);
    if (vertex === undefined) {
      vertex = this.builder.vertexCount;
      this.#known.set(key, vertex);
      const triangle = this.builder.faces.length / 3;
      this.builder.vertex(x, y, z, () => `${this.name}${place()}, triangle ${triangle}`);
    }
    this.#face.push(vertex);
    if (this.#face.length === 3) this.builder.polygon(this.#face.splice(0), this.name);
  }

  end(): void {
    if (this.#face.length > 0)
      throw new FileFault(`${this.name} ends within triangle ${this.builder.faces.length / 3}.`);
  }
}
