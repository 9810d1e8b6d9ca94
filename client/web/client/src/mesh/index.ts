export { type Derived, type Shown, type Welding } from "./derived.js";
export type { Drawn } from "./drawn.js";
export { FileFault } from "./fault.js";
export type { Mesh } from "./mesh.js";
export { OpenMesh, readMesh, type ReadOptions } from "./open_mesh.js";
export { Seams } from "./seams.js";
export type { Surface } from "./shaded.js";
export type { StoredMesh } from "./stored.js";
