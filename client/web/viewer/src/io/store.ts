import type { Document } from "../model/document.js";
import type { Steps } from "../model/history.js";
import type { Mesh, Vector3 } from "lpdeform-client/mesh/mesh";
import type { StoredMesh } from "lpdeform-client/mesh/stored";
import type { View } from "../model/view.js";

/** The work of one tab as it is kept over a reload. Its mesh is stored separately, because it seldom changes. */
export interface Work {
  /** Raised when this structure changes. Work of another version is ignored. */
  version: 2;
  id: string;
  /** location.search of the page. */
  address: string;
  /** As Date.now(). */
  savedAt: number;
  document: Document;
  /** Steps to undo and redo; earlier versions of the page stored none. */
  steps?: Steps<Document>;
  view: Partial<View>;
  /** The camera's position and target. */
  camera: { position: Vector3; target: Vector3 };
  /** Begins with the id and "/". */
  meshKey: string;
  /** Works that were set aside, the newest first; their keys begin with this id, too. */
  asides: AsideWork[];
}

export interface AsideWork extends Pick<Work, "document" | "steps" | "camera" | "meshKey"> {
  view: Pick<View, "shape" | "detail" | "selected" | "isYUp" | "pinned" | "isWelded"> & Partial<Pick<View, "weldTolerance">>;
}

/** Comes after all keys that begin with an id and "/". */
const end = (id: string) => `${id}/\uffff`;

/** The browser's database (IndexedDB), shared by all pages of this origin. Rejects with the browser's error. */
export class Store {
  private constructor(readonly database: IDBDatabase) {}

  static async open(name = "lpdeform"): Promise<Store> {
    const request = indexedDB.open(name, 1);
    request.onupgradeneeded = () => {
      request.result.createObjectStore("works", { keyPath: "id" });
      request.result.createObjectStore("meshes");
    };
    const database = await answer(request);
    // A newer version of the page must not wait for this one, which from then on reports that it keeps
    // nothing.
    database.onversionchange = () => database.close();
    return new Store(database);
  }

  /** Stores everything or nothing. `newMeshes`: meshes that are not stored yet, with their keys. */
  put(work: Work, newMeshes: readonly (readonly [Mesh | StoredMesh, string])[]): Promise<void> {
    const { id, meshKey, asides } = work;
    return this.#write((works, meshes) => {
      works.put(work);
      for (const [mesh, key] of newMeshes) meshes.put(mesh, key);
      // Deletes the keys between those in use: they belong to things that are not here any more.
      const keys = [`${id}/`, ...new Set([meshKey, ...asides.map((aside) => aside.meshKey)]), end(id)].sort();
      for (let k = 1; k < keys.length; ++k) meshes.delete(IDBKeyRange.bound(keys[k - 1], keys[k], true, true));
    });
  }

  remove(ids: readonly string[]): Promise<void> {
    return this.#write((works, meshes) => {
      for (const id of ids) {
        works.delete(id);
        meshes.delete(IDBKeyRange.bound(`${id}/`, end(id)));
      }
    });
  }

  /** The newest first. */
  async works(): Promise<Work[]> {
    const all = await answer<Work[]>(this.database.transaction("works").objectStore("works").getAll());
    return all.filter(({ version }) => version === 2).sort((a, b) => b.savedAt - a.savedAt);
  }

  /** As it was put. */
  mesh(id: string): Promise<Mesh | StoredMesh | undefined> {
    return answer<Mesh | StoredMesh | undefined>(this.database.transaction("meshes").objectStore("meshes").get(id));
  }

  #write(change: (works: IDBObjectStore, meshes: IDBObjectStore) => void): Promise<void> {
    return new Promise((resolve, reject) => {
      const transaction = this.database.transaction(["works", "meshes"], "readwrite");
      transaction.oncomplete = () => resolve();
      transaction.onabort = transaction.onerror = () => reject(transaction.error ?? new Error("not kept"));
      change(transaction.objectStore("works"), transaction.objectStore("meshes"));
      transaction.commit();
    });
  }
}

function answer<Value>(request: IDBRequest<Value>): Promise<Value> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error ?? new Error("no answer"));
  });
}
