import type { Document } from "../model/document.js";
import type { Steps } from "../model/history.js";
import type { Mesh } from "../model/mesh.js";
import type { View } from "../model/view.js";
import type { Look } from "../stage/stage.js";

/** All of some work but what can be undone. */
export interface Kept {
  mesh: Mesh;
  document: Document;
  view: Pick<View, "shape" | "detail" | "selected" | "isYUp" | "pinned" | "isWelded">;
  look: Look;
}

/** Work that has made room for other work. */
export interface Aside extends Kept {
  /** Nothing where a reload has brought it back. */
  steps?: Steps<Document>;
}

/** As the page lists it. */
export interface AsideName {
  id: number;
  name: string;
}

/** All work that has made room, the newest first. None is let go but by the user. */
export class Asides {
  #all: { id: number; work: Aside; isLetGo: boolean }[] = [];
  #newest = 0;

  put(work: Aside): void {
    this.#all.unshift({ id: ++this.#newest, work, isLetGo: false });
  }

  /** No longer here. */
  take(id: number): Aside | undefined {
    const taken = this.#all.find((one) => one.id === id);
    this.#all = this.#all.filter((one) => one !== taken);
    return taken?.work;
  }

  /** The user wants the newest no more: it is here until the page is left. */
  letGo(): void {
    if (this.#all[0]) this.#all[0].isLetGo = true;
  }

  get names(): readonly AsideName[] {
    return this.#all.map(({ id, work }) => ({ id, name: work.mesh.name }));
  }

  /** What is to be here after the page was left. */
  get wanted(): readonly Kept[] {
    return this.#all.filter(({ isLetGo }) => !isLetGo).map(({ work }) => work);
  }
}
