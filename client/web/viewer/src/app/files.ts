import { FileFault } from "../io/fault.js";
import { readHandleFile, writeHandleFile } from "../io/handlefile.js";
import { writeObj } from "../io/obj.js";
import { rewriteObj } from "../io/obj_rewrite.js";
import { writeOff } from "../io/off.js";
import { writePly } from "../io/ply.js";
import { readMesh } from "../io/read.js";
import { writeStl } from "../io/stl.js";
import { emptyDocument } from "../model/document.js";
import { guessYUp } from "../model/up.js";
import { isAtRest, type Mesh, type WrittenMesh } from "../model/mesh.js";
import { short } from "../model/words.js";
import type { App } from "./app.js";
import { sentence } from "../link/status.js";
import type { Pane } from "./pane.js";
import { pictureOf } from "./picture.js";

/** Time limit for the result that is exported. */
const solveMs = 60_000;
/** Limit of a file's size: browsers cannot hold longer texts. */
const mostBytes = 500e6;
/** Above this size, reading a file takes so long that the user is told. */
const largeBytes = 2e6;

const isHandles = ({ name }: File) => /\.json$/i.test(name);
const isMesh = ({ name }: File) => /\.(off|obj|ply|stl)$/i.test(name);

interface Exported {
  positions: Float32Array | Float64Array;
  distortion: Float32Array | Float64Array;
}

export type MeshFormat = "ply" | "obj" | "off" | "stl";

/** Opens and saves files. */
export class Files {
  readonly #input = document.createElement("input");

  constructor(readonly app: App) {
    this.#input.type = "file";
    this.#input.accept = ".off,.obj,.ply,.stl,.json";
    this.#input.multiple = true;
    this.#input.addEventListener("change", () => {
      void this.open([...(this.#input.files ?? [])]);
      this.#input.value = "";
    });
    this.#takeDrops();
  }

  choose(): void {
    this.#input.click();
  }

  /** Opens a mesh, handles, or both, in any order. Files beside a mesh, such as materials, are ignored. */
  async open(files: readonly File[]): Promise<void> {
    const meshes = files.filter(isMesh);
    if (meshes.length > 1) {
      const names = meshes.map(({ name }) => name).join(", ");
      return this.app.notify(`One mesh at a time: ${names} are ${meshes.length}.`, true);
    }
    const known = [...meshes, ...files.filter(isHandles)];
    for (const file of known.length > 0 ? known : files) {
      try {
        await this.#openFile(file);
      } catch (error) {
        const isFault = error instanceof FileFault;
        this.app.notify(isFault ? error.message : `${file.name} cannot be opened: ${(error as Error).message}`, true);
        return;
      }
    }
  }

  async #openFile(file: File): Promise<void> {
    if (file.size > mostBytes) {
      throw new FileFault(`${file.name} has ${short(file.size)}B; this page reads files of ${short(mostBytes)}B at most.`);
    }
    const done = file.size > largeBytes ? this.app.notifyWhile(`Opening ${file.name}…`) : () => undefined;
    try {
      if (file.size > largeBytes) await new Promise((seen) => setTimeout(seen, 50));
      if (isHandles(file)) this.#openHandles(file.name, await file.text());
      else this.#openMesh(file.name, new Uint8Array(await file.arrayBuffer()));
    } finally {
      done();
    }
  }

  /** In the doubles of the server's result, which are more precise than the drawn surface. */
  async exportMesh(format: MeshFormat): Promise<void> {
    const panes = [...this.app.panes];
    const stem = this.#stem;
    for (const pane of panes) {
      const { mesh } = pane.stage.surface!;
      const { positions, distortion } = await this.#exactly(pane);
      const { faces, corners, obj } = mesh;
      const deformed: WrittenMesh = { positions, faces, ...(corners && { corners }) };
      const name = `${stem}-deformed${panes.length > 1 ? `-${pane.side}` : ""}.${format}`;
      if (format === "ply") save(name, writePly(deformed, distortion, this.app.red));
      if (format === "obj") save(name, obj ? rewriteObj({ ...mesh, obj }, positions) : writeObj(deformed));
      if (format === "off") save(name, writeOff(deformed));
      if (format === "stl") save(name, writeStl(deformed));
      const lost = lostIn(mesh, format);
      if (lost.length > 0) {
        const better = obj ? " Saved as OBJ, they stay." : "";
        this.app.notify(`${name} does not have what the original file also had: ${lost.join(", ")}.${better}`);
      }
    }
  }

  async #exactly({ stage, live, distortion }: Pane): Promise<Exported> {
    const { positions, mesh } = stage.surface!;
    const shown = { positions, distortion };
    const isHeld = this.app.document.handles.length > 0;
    if (!isHeld && isAtRest(positions, mesh.positions)) {
      return { positions: mesh.exact ?? mesh.positions, distortion: distortion.slice().fill(0) };
    }
    const done = this.app.notifyWhile("Exporting: computing the result in full precision…");
    try {
      return await live!.solve(solveMs);
    } catch (thrown) {
      const why = sentence((thrown as Error).message);
      this.app.notify(`What is shown was written as it is, rounded for the screen. ${why}`, true);
      return shown;
    } finally {
      done();
    }
  }

  exportPicture(): void {
    pictureOf(this.app).toBlob((blob) => {
      if (blob) save(`${this.#stem}.png`, blob);
      else this.app.notify("The browser makes no picture of this size: make the window smaller.", true);
    });
  }

  saveHandles(): void {
    if (this.app.document.handles.length === 0) {
      return this.app.notify("There are no handles to save: click the surface to place one.", true);
    }
    save(`${this.#stem}-handles.json`, writeHandleFile(this.app.document, this.app.mesh.name));
  }

  get #stem(): string {
    return this.app.mesh.name.replace(/\.[^.]*$/, "") || "mesh";
  }

  #openMesh(name: string, bytes: Uint8Array): void {
    const mesh = readMesh(name, bytes);
    const { p, secondP } = this.app.document;
    this.app.open(mesh, { ...emptyDocument, p, secondP });
    const isYUp = guessYUp(mesh);
    this.app.view.set({ tool: "move", isYUp });
    const up = ` Shown with ${isYUp ? "y" : "z"} up, as it seems: “Y is up” in the panel turns it.`;
    const count = (mesh.positions.length / 3).toLocaleString("en");
    const { seamVertices } = this.app.facts.now;
    const welded = `, ${seamVertices.toLocaleString("en")} of them copies along seams, welded: the panel “Mesh” has a switch`;
    this.app.notify(`${name}: ${count} vertices${seamVertices > 0 ? welded : ""}.${up}`);
  }

  #openHandles(name: string, text: string): void {
    const { app } = this;
    const { seams } = app;
    app.change(readHandleFile(text, app.document, app.mesh, (vertices) => seams?.withCopies(vertices) ?? vertices));
    app.view.set({ selected: app.document.handles.at(-1)!.name });
    app.notify(`${name}: ${app.document.handles.length} handles.`);
  }

  #takeDrops(): void {
    const { classList } = document.body;
    document.addEventListener("dragover", (event) => {
      event.preventDefault();
      classList.add("dropping");
    });
    document.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) classList.remove("dropping");
    });
    document.addEventListener("drop", (event) => {
      event.preventDefault();
      classList.remove("dropping");
      void this.open([...(event.dataTransfer?.files ?? [])]);
    });
  }
}

/** What a file had that this format cannot hold, in words. */
function lostIn({ beside = [], corners, obj }: Mesh, format: MeshFormat): readonly string[] {
  if (format === "obj" && obj) return [];
  return format === "stl" && corners ? [...beside, "faces of more than three corners"] : beside;
}

function save(name: string, content: Blob | string | Uint8Array<ArrayBuffer>): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
