import { FileFault } from "lpdeform-client/mesh/fault";
import { newGlb } from "../io/write_glb.js";
import { rewriteGlb } from "../io/gltf_rewrite.js";
import { readHandleFile, writeHandleFile } from "../io/handlefile.js";
import { writeObj } from "../io/write_obj.js";
import { keepOnly, openedMesh } from "../io/opened.js";
import { rewriteObj } from "../io/obj_rewrite.js";
import { keepsPly, rewritePly } from "../io/ply_rewrite.js";
import { writeOff } from "../io/write_off.js";
import { writePly } from "../io/write_ply.js";
import { type Document, emptyDocument } from "../model/document.js";
import { derivedOf } from "lpdeform-client/mesh/derived";
import { isAtRest, type Mesh, type WrittenMesh } from "lpdeform-client/mesh/mesh";
import { short } from "../model/words.js";
import type { App } from "./app.js";
import { sentence } from "../link/status.js";
import type { Pane } from "./pane.js";
import { pictureOf } from "./picture.js";
import { openProject, saveProject } from "./projects.js";
import { pressing } from "./touch.js";

/** Time limit for the result that is exported. */
const solveMs = 60_000;
/** Limit of a file's size: browsers cannot hold longer texts. */
const mostBytes = 500e6;
/** Of an FBX, COLLADA or 3MF file. */
const mostForeignBytes = 100e6;
/** Above this size, reading a file takes so long that the user is told. */
const largeBytes = 2e6;

const isHandles = ({ name }: File) => /\.json$/i.test(name);
const isProject = ({ name }: File) => /\.lpdeform$/i.test(name);
const isForeign = ({ name }: File) => /\.(fbx|dae|3mf)$/i.test(name);
const isMesh = (file: File) => /\.(glb|gltf|off|obj|ply|stl)$/i.test(file.name) || isForeign(file);

const handlesOf = ({ handles }: Document) => (handles.length === 1 ? "a handle" : `${handles.length} handles`);

interface Exported {
  positions: Float32Array | Float64Array;
  distortion: Float32Array | Float64Array;
}

export type MeshFormat = "glb" | "ply" | "obj" | "off" | "stl";

/** Opens and saves files. */
export class Files {
  readonly #input = document.createElement("input");
  /** The end of what was opened last: handles that are opened after a mesh are for that mesh. */
  #opened: Promise<unknown> = Promise.resolve();

  constructor(readonly app: App) {
    this.#input.type = "file";
    this.#input.accept =
      ".glb,.gltf,.bin,.off,.obj,.mtl,.png,.jpg,.jpeg,.webp,.bmp,.gif,.ply,.stl,.fbx,.dae,.3mf,.json,.lpdeform";
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

  /**
   * Opens a project, or a mesh, handles, or both, in any order. Files beside a mesh are ignored, except those that a glTF names, and
   * the MTL and images of an OBJ.
   */
  async open(files: readonly File[]): Promise<void> {
    const meshes = files.filter(isMesh);
    if (meshes.length > 1) {
      const names = meshes.map(({ name }) => name).join(", ");
      return this.app.notify(`One mesh at a time: ${names} are ${meshes.length}.`, true);
    }
    const projects = files.filter(isProject);
    if (projects.length > 0 && files.length > 1) {
      return this.app.notify(`A project is opened alone: ${projects[0]!.name} is one of ${files.length} files.`, true);
    }
    const known = [...projects, ...meshes, ...files.filter(isHandles)];
    for (const file of known.length > 0 ? known : files) {
      try {
        if (!(await this.#openFile(file, files))) return;
      } catch (error) {
        const isFault = error instanceof FileFault;
        this.app.notify(isFault ? error.message : `${file.name} cannot be opened: ${(error as Error).message}`, true);
        return;
      }
    }
  }

  /** False if something else is opened in the meantime: then that is what the user wants. */
  async #openFile(file: File, files: readonly File[]): Promise<boolean> {
    if (file.size === 0) throw new FileFault(`${file.name} is empty.`);
    checkSize(file.name, file.size);
    const done = file.size > largeBytes ? this.app.notifyWhile(`Opening ${file.name}…`) : () => undefined;
    try {
      if (!isHandles(file)) {
        const opening = this.#openWork(file, files);
        this.#opened = opening.catch(() => undefined);
        return await opening;
      }
      await this.#opened;
      return await this.#openHandles(file);
    } finally {
      done();
    }
  }

  async #openWork(file: File, files: readonly File[]): Promise<boolean> {
    if (isProject(file)) return this.#openProject(file);
    if (isForeign(file)) return this.#openForeign(file);
    return this.#openMesh(async () => openedMesh(file, await besideOf(file, files)));
  }

  async #openForeign(file: File): Promise<boolean> {
    if (file.size > mostForeignBytes) {
      throw new FileFault(
        `${file.name} has ${short(file.size)}B; this page reads such files of ${short(mostForeignBytes)}B at most.`,
      );
    }
    let first = "";
    const read = async () => {
      const { glbOf } = await import("../io/foreign.js");
      const { glb, left } = await glbOf(file);
      const gone = left.length > 0 ? `Left out: ${left.join(", ")}. ` : "";
      first = `${file.name} is opened as ${glb.name}. ${gone}`;
      return openedMesh(glb, []);
    };
    return this.#openMesh(read, () => first);
  }

  /** In the doubles of the server's result, which are more precise than the drawn surface. */
  async exportMesh(format: MeshFormat): Promise<void> {
    const panes = [...this.app.panes];
    const stem = this.#stem;
    for (const pane of panes) {
      const { mesh } = pane.stage.surface!;
      const { positions, distortion } = await this.#exactly(pane);
      const { faces, corners, obj, gltf, ply } = mesh;
      const deformed: WrittenMesh = { positions, faces, ...(corners && { corners }) };
      const name = `${stem}-deformed${panes.length > 1 ? `-${pane.side}` : ""}.${format}`;
      if (format === "glb") save(name, gltf ? rewriteGlb({ ...mesh, gltf }, positions) : newGlb(deformed));
      if (format === "ply") save(name, this.#plyOf(mesh, deformed, distortion));
      if (format === "obj") save(name, obj ? rewriteObj({ ...mesh, obj }, positions) : writeObj(deformed));
      if (format === "off") save(name, writeOff(deformed));
      if (format === "stl") save(name, (await import("../io/write_stl.js")).writeStl(deformed));
      const kept = obj ? "OBJ" : gltf ? "GLB" : ply && keepsPly(mesh) ? "PLY" : "";
      this.#sayLost(name, lostIn(mesh, format), kept && ` Saved as ${kept}, they stay.`);
    }
  }

  #plyOf(mesh: Mesh, deformed: WrittenMesh, distortion: Exported["distortion"]): Uint8Array<ArrayBuffer> {
    if (keepsPly(mesh)) return rewritePly(mesh, deformed.positions, distortion);
    return writePly(deformed, distortion, this.app.red, this.app.view.now.palette);
  }

  #sayLost(name: string, lost: readonly string[], better = ""): void {
    if (lost.length === 0) return;
    this.app.notify(`${name} does not have what the original file also had: ${lost.join(", ")}.${better}`);
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

  /** Everything that is needed to go on: mesh with its images, handles, fields, settings and camera. */
  async saveProject(): Promise<void> {
    const name = `${this.#stem}.lpdeform`;
    try {
      save(name, await saveProject(this.app));
    } catch (thrown) {
      this.app.notify(`${name} was not saved. ${sentence((thrown as Error).message)}`, true);
    }
  }

  async #openProject(file: File): Promise<boolean> {
    if (!(await openProject(this.app, file))) return false;
    this.app.notify(`${file.name}: “${this.app.mesh.name}” with ${handlesOf(this.app.document)}.`);
    return true;
  }

  async exportPoses(as: "glb" | "video"): Promise<void> {
    const { posesAsGlb, posesAsVideo } = await import("./filming.js");
    try {
      const content = as === "glb" ? await posesAsGlb(this.app) : await posesAsVideo(this.app);
      if (content instanceof Blob)
        save(`${this.#stem}-poses.${content.type.startsWith("video/mp4") ? "mp4" : "webm"}`, content);
      else if (content) {
        const name = `${this.#stem}-poses.glb`;
        save(name, content);
        this.#sayLost(name, this.app.mesh.beside ?? []);
      }
    } catch (thrown) {
      this.app.notify(`The poses were not exported. ${sentence((thrown as Error).message)}`, true);
    }
  }

  saveHandles(): void {
    this.app.flush();
    if (this.app.document.handles.length === 0) {
      return this.app.notify(`There are no handles to save: ${pressing()} the surface to place one.`, true);
    }
    save(`${this.#stem}-handles.json`, writeHandleFile(this.app.document, this.app.mesh));
  }

  get #stem(): string {
    return this.app.mesh.name.replace(/\.[^.]*$/, "") || "mesh";
  }

  /** `first`: what the user is told before what is said of every mesh. */
  async #openMesh(read: () => Promise<Mesh>, first = () => ""): Promise<boolean> {
    const isNewest = this.app.opening();
    const mesh = await read();
    if (!isNewest()) {
      keepOnly(this.app.mesh);
      return false;
    }
    const { name } = mesh;
    const { p, secondP } = this.app.history.settled; // poses that play change them
    this.app.open(mesh, { ...emptyDocument, p, secondP });
    const { isYUp } = derivedOf(mesh);
    this.app.view.set({ tool: "move", isYUp });
    const up = ` Shown with ${isYUp ? "y" : "z"} up, as it seems: “Y is up” in the panel turns it.`;
    const count = (mesh.positions.length / 3).toLocaleString("en");
    const { seamVertices, looseVertices } = this.app.facts.now;
    const welded = `, ${seamVertices.toLocaleString("en")} of them copies along seams, welded: the panel “Mesh” has a switch`;
    const loose = ` Where ${looseVertices.toLocaleString("en")} vertices of its borders lie near others it comes apart, unless “Weld within” in the panel “Mesh” joins them.`;
    const torn = looseVertices > 0 ? loose : "";
    const still = stillIn(mesh);
    this.app.notify(`${first()}${name}: ${count} vertices${seamVertices > 0 ? welded : ""}.${still}${torn}${up}`);
    return true;
  }

  async #openHandles(file: File): Promise<boolean> {
    const { app } = this;
    const { name } = file;
    const { mesh } = app;
    const text = await file.text();
    if (app.mesh !== mesh) return false;
    const { seams } = app;
    app.change(
      naming(name, () => readHandleFile(text, app.document, app.mesh, (vertices) => seams?.withCopies(vertices) ?? vertices)),
      true,
    );
    app.view.set({ selected: app.document.handles.at(-1)!.name });
    app.notify(`${name}: ${handlesOf(app.document)}.`);
    return true;
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

/** How many parts stay as they are; the panel has a sentence on each. */
function stillIn({ notices = [] }: Mesh): string {
  if (notices.length === 0) return "";
  if (notices.length === 1) return " A part of it stays as it is: the panel “Mesh” names it.";
  return ` ${notices.length.toLocaleString("en")} parts of it stay as they are: the panel “Mesh” names them.`;
}

/** Puts the file's name before what is wrong with it. */
function naming<Value>(name: string, read: () => Value): Value {
  try {
    return read();
  } catch (error) {
    if (!(error instanceof FileFault)) throw error;
    throw new FileFault(`${name}: ${error.message}`);
  }
}

/** What is read together with the file. Throws a FileFault if it is too much. */
async function besideOf(file: File, files: readonly File[]): Promise<File[]> {
  const others = files.filter((other) => other !== file);
  const beside = /\.gltf$/i.test(file.name) ? others : /\.obj$/i.test(file.name) ? await materialsOf(others) : [];
  const bytes = beside.reduce((sum, { size }) => sum + size, file.size);
  if (beside.length > 0) checkSize(`${file.name} together with the files beside it`, bytes);
  return beside;
}

async function materialsOf(files: readonly File[]): Promise<File[]> {
  return files.length > 0 ? (await import("../io/obj_textures.js")).materialFiles(files) : [];
}

function checkSize(what: string, bytes: number): void {
  if (bytes <= mostBytes) return;
  throw new FileFault(`${what} has ${short(bytes)}B; this page reads files of ${short(mostBytes)}B at most.`);
}

/** What a file had that this format cannot hold, in words. */
function lostIn(mesh: Mesh, format: MeshFormat): readonly string[] {
  const { beside = [], corners, obj, gltf } = mesh;
  if ((format === "obj" && obj) || (format === "glb" && gltf) || (format === "ply" && keepsPly(mesh))) return [];
  return (format === "stl" || format === "glb") && corners ? [...beside, "faces of more than three corners"] : beside;
}

function save(name: string, content: Blob | string | Uint8Array<ArrayBuffer>): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content]));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
