import { existsSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";

/** Models in many formats, damaged ones among them, of Debian's package assimp-testmodels. */
const folder = "/usr/share/assimp/models";

/** Where the sample with this path lies. */
export const pathOf = (path: string) => join(folder, path);

export interface Sample {
  /** Within the package: "glTF2/cameras/Cameras.gltf". */
  path: string;
  name: string;
  bytes: Uint8Array<ArrayBuffer>;
  /** What lies in the same folder, by name. */
  beside: ReadonlyMap<string, Uint8Array<ArrayBuffer>>;
}

/** The samples whose names end so, in the order of their paths. */
export function samplesOf(endings: RegExp): readonly Sample[] {
  if (!existsSync(folder)) throw new Error(`${folder} is missing; deploy/install test brings it`);
  const files = readdirSync(folder, { recursive: true, withFileTypes: true }).filter((file) => file.isFile());
  const found = files.filter(({ name }) => endings.test(name));
  const all = found.map(({ parentPath, name }) => join(parentPath, name).slice(folder.length + 1));
  return all.sort().map((path) => {
    const here = dirname(join(folder, path));
    const name = path.slice(dirname(path).length + 1);
    const others = files.filter((file) => file.parentPath === here && file.name !== name);
    const read = (file: string) => new Uint8Array(readFileSync(join(here, file)));
    return { path, name, bytes: read(name), beside: new Map(others.map((file) => [file.name, read(file.name)])) };
  });
}
