import { forget, remember, remembered } from "../io/remember.js";
import { openedStored, storedOf } from "../io/opened.js";
import { restored, type StoredMesh } from "lpdeform-client/mesh/stored";
import { type AsideWork, Store, type Work } from "../io/store.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { stepsToKeep } from "../model/kept_steps.js";
import type { View } from "../model/view.js";
import type { App } from "./app.js";
import { type Kept, weldingOf } from "./asides.js";
import { claim, whileFree } from "./claim.js";

/** When the user wants to see work again at which the page stopped last time. */
export type WhenToShow = "now" | "later" | "never";

const key = "lpdeform-work";
/**
 * Stored for all tabs while work is being restored. If it is found at the start, the page did not survive the previous restore.
 */
const restoringKey = (id: string) => `lpdeform-restoring-${id}`;
const saveEveryMs = 500;
/** Longer than a page that is being reloaded takes to release its work. */
const patienceMs = 3000;
const mostWorks = 8;
const oldestMs = 30 * 24 * 3600 * 1000;

/**
 * Keeps the work of this tab in the browser, and restores it after a reload; in a new tab, restores the work of a closed one.
 * Each tab holds a lock on its work, so that no two tabs write to the same work.
 */
export class Keeper {
  /** The work is kept, except changes of the last moment, which are kept when the page is left. */
  isKeeping = false;
  #store: Store | undefined;
  #id = "";
  /** Keys of the meshes that are kept. */
  #kept = new Map<Mesh, string>();
  /** Whether the tab's work is still the one that was put off. */
  #hasPutOff = false;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #isSaving = false;
  /** Counts what was begun to be saved. */
  #saves = 0;
  #camera = "";

  /**
   * `wantsBack`: asks when the user wants to see work again at which the page stopped last time; its argument is the mesh's
   * name.
   */
  constructor(
    readonly app: App,
    readonly wantsBack: (name: string) => Promise<WhenToShow>,
  ) {}

  /** Returns true if there was work. If the browser keeps nothing, the page works without it. */
  async restore(): Promise<boolean> {
    try {
      const store = await within(Store.open(), patienceMs);
      const work = await this.#claimWork(store);
      const kept = work && (await store.mesh(work.meshKey));
      this.#store = store;
      if (!work || !kept) return false;
      const when = remembered(restoringKey(work.id)) ? await this.wantsBack(nameOf(kept)) : "now";
      if (when === "never") forget(restoringKey(work.id));
      if (when === "later") await this.#putOff();
      if (when !== "now") return false;
      await this.#show(work, "blob" in kept ? await openedStored(kept, weldingOf(work.view)) : kept);
      await this.#showAsides(store, work);
      return true;
    } catch {
      return false;
    }
  }

  /** Keeps every change from now on. */
  start(): void {
    const { app } = this;
    if (!this.#store) return;
    app.facts.watch(
      ({ document, mesh, setAside }) => [document, mesh, setAside],
      ([document, mesh, setAside], before) => {
        const isNew = mesh !== before[1];
        if (isNew) this.isKeeping = false;
        if (document !== before[0] && !isNew) app.facts.set({ restoredFrom: undefined });
        if (document !== before[0] || isNew || setAside !== before[2]) this.#soon(isNew ? 0 : saveEveryMs);
      },
    );
    app.view.watchAll(() => this.#soon());
    app.afterDrawing.add(() => {
      const camera = JSON.stringify(app.look);
      if (camera !== this.#camera) this.#soon();
      this.#camera = camera;
    });
    window.addEventListener("pagehide", () => {
      if (this.#timer !== undefined || this.#isSaving) void this.#save(true);
    });
    document.addEventListener("visibilitychange", () => {
      if (this.#timer !== undefined) void this.#save();
    });
  }

  /** The work of this tab, of this tab before the reload, or of a closed tab. */
  async #claimWork(store: Store): Promise<Work | undefined> {
    const own = sessionStorage.getItem(key);
    if (own && (await claim(own, patienceMs))) this.#id = own;
    if (!own) {
      for (const { id, address } of await store.works()) {
        if (address !== location.search || !(await claim(id, 0))) continue;
        this.#id = id;
        break;
      }
    }
    if (this.#id === "") await this.#claimNew();
    sessionStorage.setItem(key, this.#id);
    // From here on no other tab writes to it.
    const works = await store.works();
    void this.#makeRoom(store, works).catch(() => undefined); // the next page tries again
    return works.find(({ id, address }) => id === this.#id && address === location.search);
  }

  async #claimNew(): Promise<void> {
    this.#id = newId();
    await claim(this.#id, patienceMs);
  }

  /** The work stays kept. The next tab that gets it asks again; that may be this one, unless it has other work by then. */
  async #putOff(): Promise<void> {
    await this.#claimNew();
    this.#hasPutOff = true;
  }

  /** From now on this work is the tab's, and not the one that was put off. */
  #takeTab(): void {
    if (!this.#hasPutOff) return;
    sessionStorage.setItem(key, this.#id);
    this.#hasPutOff = false;
  }

  /** Removes old or excessive works, but none that a tab has open, including this one. */
  async #makeRoom(store: Store, works: readonly Work[]): Promise<void> {
    const old = works.filter(({ savedAt }, k) => k >= mostWorks || savedAt < Date.now() - oldestMs);
    for (const { id } of old) {
      await whileFree(id, async () => {
        await store.remove([id]);
        forget(restoringKey(id));
      });
    }
  }

  async #show({ document, view, camera, savedAt, meshKey, steps }: Work, mesh: Mesh): Promise<void> {
    const { app } = this;
    const { selected, pinned, shape, ...look } = view;
    this.#watchOver(mesh);
    app.view.set(look);
    const { detail, isYUp, isWelded, weldTolerance } = { ...app.view.now, ...look };
    const kept = { selected, pinned, shape: shape ?? "", detail, isYUp, isWelded, weldTolerance };
    await app.restore({ mesh, document, view: kept, look: camera, ...(steps && { steps }) });
    app.facts.set({ restoredFrom: savedAt });
    this.#kept.set(mesh, meshKey);
    this.isKeeping = true;
  }

  async #showAsides(store: Store, { asides = [] }: Work): Promise<void> {
    const works: Kept[] = [];
    for (const { meshKey, document, view, camera, steps } of asides) {
      const mesh = await keptMesh(store, meshKey).catch(() => undefined); // the others are not lost with it
      if (!mesh) continue;
      works.push({ mesh, document, view, look: camera, ...(steps && { steps }) });
      this.#kept.set(mesh, meshKey);
    }
    this.app.setAside(works);
  }

  /** Until the first picture, with its textures, or until the page is left in the normal way. */
  #watchOver(mesh: Mesh): void {
    const { app } = this;
    const { afterDrawing } = app;
    const mark = restoringKey(this.#id);
    remember(mark, "yes");
    const over = () => {
      forget(mark);
      afterDrawing.delete(drawn);
      window.removeEventListener("pagehide", over);
    };
    const drawn = () => app.mesh === mesh && !app.panes.some(({ isDressing }) => isDressing) && over();
    afterDrawing.add(drawn);
    window.addEventListener("pagehide", over);
  }

  #soon(pauseMs = saveEveryMs): void {
    if (pauseMs === 0) clearTimeout(this.#timer);
    else if (this.#timer !== undefined) return;
    this.#timer = setTimeout(() => void this.#save(), pauseMs);
  }

  /** `isLeaving`: there is no time for a worker's answer, nor for a save under way. */
  async #save(isLeaving = false): Promise<void> {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    if (this.#isSaving && !isLeaving) return this.#soon();
    this.#isSaving = true;
    const number = ++this.#saves;
    this.app.flush();
    const { isDark: _, hasSingleKeys: __, ...view }: View = this.app.view.now;
    const works = this.app.worthKeeping;
    const keys = new Map(works.map(({ mesh }) => [mesh, this.#kept.get(mesh) ?? `${this.#id}/${newId()}`]));
    const [kept, ...asides] = works.map((one) => ({ ...one, meshKey: keys.get(one.mesh)!, camera: one.look, ...stepsOf(one) }));
    try {
      if (kept) {
        const { document, camera, meshKey, steps } = kept;
        const { search: address } = location;
        const work = {
          version: 2,
          id: this.#id,
          address,
          savedAt: Date.now(),
          document,
          camera,
          meshKey,
          ...(steps && { steps }),
        } as const;
        const isNew = [...keys].filter(([mesh]) => !this.#kept.has(mesh));
        const newMeshes = isLeaving
          ? isNew
          : await Promise.all(isNew.map(async ([mesh, key]) => [await storedOf(mesh), key] as const));
        if (number !== this.#saves) return; // the page was left meanwhile, with what is newest
        const stored = this.#store!.put(
          { ...work, view: { ...view, ...kept.view }, asides: asides.map(withoutMesh) },
          newMeshes,
        );
        if (isLeaving) this.#takeTab(); // in a page that is being left, nothing may run after an await
        await stored;
        this.#takeTab();
      } else {
        await this.#store!.remove([this.#id]);
      }
      this.#kept = keys;
      this.isKeeping = true;
    } catch {
      this.isKeeping = false;
      this.#kept.clear(); // full, or forbidden: the page asks before it is left
    } finally {
      if (number === this.#saves) this.#isSaving = false;
    }
  }
}

/** Undefined if it is not kept. Rejects if it cannot be read. */
async function keptMesh(store: Store, meshKey: string): Promise<Mesh | undefined> {
  const kept = await store.mesh(meshKey);
  return kept && "blob" in kept ? restored(kept) : kept;
}

function nameOf(kept: Mesh | StoredMesh): string {
  return "blob" in kept ? (kept.rest.name ?? "") : kept.name;
}

function withoutMesh({ document, steps, view, camera, meshKey }: AsideWork): AsideWork {
  return { document, view, camera, meshKey, ...(steps && { steps }) };
}

function stepsOf({ steps }: Kept): Pick<Kept, "steps"> {
  return steps ? { steps: stepsToKeep(steps) } : {};
}

function newId(): string {
  return [...crypto.getRandomValues(new Uint8Array(8))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

function within<Value>(promise: Promise<Value>, milliseconds: number): Promise<Value> {
  const late = new Promise<never>((_, reject) => setTimeout(() => reject(new Error("too late")), milliseconds));
  return Promise.race([promise, late]);
}
