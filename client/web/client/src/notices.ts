import type { BetterShapeNotice, Frame, Notice, ServerNotice } from "./types.js";

/** The notices of a stream that still apply. */
export class Notices {
  #ofServer: ServerNotice | undefined;
  #better: BetterShapeNotice | undefined;

  /** A better shape takes precedence: it concerns the newest result, and load the next updates. */
  get last(): Notice | undefined {
    return this.#better ?? this.#ofServer;
  }

  add(notice: Notice): void {
    if (notice.reason === "better_shape") this.#better = notice;
    else this.#ofServer = notice;
  }

  /** Drops the notice of a better shape. Returns false if there was none. */
  dropBetter(): boolean {
    const hadBetter = this.#better !== undefined;
    this.#better = undefined;
    return hadBetter;
  }

  /** Drops the notice of a better shape if the frame answers a later update or is the shape. Returns false otherwise. */
  shown({ inputSeq, energy }: Pick<Frame, "inputSeq" | "energy">): boolean {
    const better = this.#better;
    return better !== undefined && (inputSeq > better.inputSeq || energy <= better.energy) && this.dropBetter();
  }

  /** Drops all. Returns false if there were none. */
  clear(): boolean {
    const hadAny = this.last !== undefined;
    this.#ofServer = this.#better = undefined;
    return hadAny;
  }
}
