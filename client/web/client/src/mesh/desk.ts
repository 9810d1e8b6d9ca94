import type { Packed, Shaded, Unpacked } from "../types.js";
import { unpackLoaded } from "../unpack.js";
import { type Derived, derive, derivedOf, isKnown, know, type Welding } from "./derived.js";
import type { Mesh } from "./mesh.js";
import { pullOf } from "./pull.js";
import { parseMesh } from "./read.js";
import { shadedOf, type Surface } from "./shaded.js";
import { restored, type StoredMesh, stored } from "./stored.js";

/** Vertices that are pulled, and those that others hold. */
export interface PullRequest {
  pulled: readonly number[];
  held: readonly number[];
}

/** Where a mesh comes from. */
export type Source = { file: File; beside: readonly File[] } | { mesh: Mesh } | { stored: StoredMesh };

/** What can be asked, by name, and the answer. The first question opens a mesh; the others are about that mesh. */
export interface Questions {
  open: [Source & { welding: Welding }, Opening];
  weld: [Welding, Derived];
  unpack: [Packed, Unpacked & { shaded: Shaded }];
  shade: [Surface, Shaded];
  pull: [PullRequest, Float32Array];
  store: [undefined, StoredMesh];
}

/** `mesh`: undefined if it was given. */
export interface Opening {
  mesh: Mesh | undefined;
  derived: Derived;
}

/** Answers questions about one mesh, in a worker or in the page. */
export class Desk {
  #mesh: Mesh | undefined;

  /** `mesh`: one that is open already. */
  constructor(mesh?: Mesh) {
    this.#mesh = mesh;
  }

  readonly #answers: { [Name in keyof Questions]: (asked: Questions[Name][0]) => Promise<Questions[Name][1]> } = {
    open: async ({ welding, ...source }) => {
      this.#mesh = await meshOf(source);
      return { mesh: "mesh" in source ? undefined : this.#mesh, derived: this.#derive(this.#mesh, welding) };
    },
    weld: async (welding) => this.#derive(this.#opened, welding),
    unpack: async (packed) => {
      const unpacked = await unpackLoaded(packed);
      return { ...unpacked, shaded: this.#shade(unpacked) };
    },
    shade: async (surface) => this.#shade(surface),
    pull: async ({ pulled, held }) => {
      const mesh = this.#opened;
      return pullOf(mesh.positions, derivedOf(mesh).shown.adjacency, pulled, held);
    },
    store: async () => stored(this.#opened),
  };

  answer<Name extends keyof Questions>(name: Name, asked: Questions[Name][0]): Promise<Questions[Name][1]> {
    return this.#answers[name](asked);
  }

  get #opened(): Mesh {
    if (!this.#mesh) throw new Error("No mesh is open.");
    return this.#mesh;
  }

  #derive(mesh: Mesh, welding: Welding): Derived {
    if (!isKnown(mesh, welding)) know(mesh, derive(mesh, welding));
    return derivedOf(mesh);
  }

  #shade(surface: Surface): Shaded {
    return shadedOf(surface, this.#opened, derivedOf(this.#opened));
  }
}

async function meshOf(source: Source): Promise<Mesh> {
  if ("mesh" in source) return source.mesh;
  if ("stored" in source) return restored(source.stored);
  const bytesOf = async (one: File) => new Uint8Array(await one.arrayBuffer());
  const others = source.beside.map(async (one) => [one.name, await bytesOf(one)] as const);
  return parseMesh(source.file.name, await bytesOf(source.file), new Map(await Promise.all(others)));
}
