import type { Document } from "../model/document.js";
import type { Steps } from "../model/history.js";
import { usualWelding, type Welding } from "lpdeform-client/mesh/derived";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import type { View } from "../model/view.js";
import type { Look } from "../stage/stage.js";

/** Work as it is kept over a reload. */
export interface Kept {
  mesh: Mesh;
  document: Document;
  view: Pick<View, "shape" | "detail" | "selected" | "isYUp" | "pinned" | "isWelded"> & Partial<Pick<View, "weldTolerance">>;
  look: Look;
  /** Work that earlier versions of the page have kept has none. */
  steps?: Steps<Document>;
}

/** Work that earlier versions of the page have kept has no tolerance. */
export function weldingOf({ isWelded, weldTolerance }: Partial<Pick<View, "isWelded" | "weldTolerance">>): Welding {
  return { isOn: isWelded ?? usualWelding.isOn, tolerance: weldTolerance ?? usualWelding.tolerance };
}

/** A work's entry in the page's list. */
export interface AsideName {
  id: number;
  name: string;
}

/** All works that were set aside, the newest first. Only the user removes them. */
export class Asides {
  #all: { id: number; work: Kept; isLetGo: boolean }[] = [];
  #newest = 0;

  put(work: Kept): void {
    this.#all.unshift({ id: ++this.#newest, work, isLetGo: false });
  }

  find(id: number): Kept | undefined {
    return this.#all.find((one) => one.id === id)?.work;
  }

  /** Takes the work out of the list. */
  take(id: number): Kept | undefined {
    const taken = this.#all.find((one) => one.id === id);
    this.#all = this.#all.filter((one) => one !== taken);
    return taken?.work;
  }

  /** The user does not want the newest any more. It stays until the page is left. */
  release(): void {
    if (this.#all[0]) this.#all[0].isLetGo = true;
  }

  get names(): readonly AsideName[] {
    return this.#all.map(({ id, work }) => ({ id, name: work.mesh.name }));
  }

  /** What must be available after a reload. */
  get wanted(): readonly Kept[] {
    return this.#all.filter(({ isLetGo }) => !isLetGo).map(({ work }) => work);
  }
}
