import { indexOf, logicalLines } from "lpdeform-client/mesh/obj_lines";
import type { Texturing, TextureLayer } from "../model/texturing.js";

/** Files that were opened with an OBJ, by name. */
export type MaterialFiles = Readonly<Record<string, Blob>>;

/** Of an MTL file: its diffuse colour and image. */
interface Material {
  colour: readonly [number, number, number];
  image: string | undefined;
  isRepeated: boolean;
}

/** How many lines are read before the page may do something else. */
const linesAtOnce = 10_000;

/** The page may do something else. */
const others = () => new Promise<void>((go) => setTimeout(go));

const white: Material = { colour: [1, 1, 1], image: undefined, isRepeated: true };

/**
 * The diffuse images and colours of an OBJ file (“map_Kd” and “Kd” of its MTL files), for what readObj() reads of it. Images that are
 * named and were not opened with it are listed as missing. Rejects if the browser no longer has a file.
 */
export async function readObjTextures(obj: Uint8Array, files: MaterialFiles): Promise<Texturing> {
  const coordinates: number[] = [];
  const corners: number[] = [];
  const libraries: string[] = [];
  const runs: { material: string; firstFace: number; faceCount: number }[] = [];
  let present = "";
  let lineCount = 0;
  for (const { words } of logicalLines(new TextDecoder().decode(obj))) {
    if (++lineCount % linesAtOnce === 0) await others();
    const [key, ...values] = words;
    if (key === "mtllib") for (const name of [values.join(" "), ...values]) libraries.push(name);
    if (key === "vt") coordinates.push(Number(values[0] ?? 0), 1 - Number(values[1] ?? 0));
    if (key === "usemtl") present = values.join(" ");
    if (key !== "f") continue;
    const places = values.map((word) => placeOf(word.split("/")[1], coordinates.length / 2));
    for (let k = 2; k < places.length; ++k) corners.push(places[0]!, places[k - 1]!, places[k]!);
    const faceCount = places.length - 2;
    if (runs.at(-1)?.material === present) runs.at(-1)!.faceCount += faceCount;
    else runs.push({ material: present, firstFace: corners.length / 3 - faceCount, faceCount });
  }
  const byName = new Map(Object.entries(files).map(([name, file]) => [name.toLowerCase(), file]));
  const materials = await materialsOf(byName, libraries);
  const missing = new Set<string>();
  const layers = runs.map(({ material, firstFace, faceCount }): TextureLayer => {
    const { image: path, colour, isRepeated } = materials.get(material) ?? white;
    const image = path === undefined ? undefined : byName.get(baseOf(path));
    if (path !== undefined && !image) missing.add(path);
    return { firstFace, faceCount, colour, isRepeated, ...(image && { image }) };
  });
  // Corners without a place are at the first one, or where there is none at 0.
  const count = coordinates.length / 2;
  const known = (place: number) => (place >= 0 && place < count ? place : 0);
  return {
    coordinates: Float32Array.from(count > 0 ? coordinates : [0, 0]),
    corners: Uint32Array.from(corners, known),
    layers,
    missing: [...missing],
  };
}

/** Of the MTL files that the OBJ names, the first of them first, or of all if none of those is there. */
async function materialsOf(
  byName: ReadonlyMap<string, Blob>,
  libraries: readonly string[],
): Promise<ReadonlyMap<string, Material>> {
  const named = [...new Set(libraries.map(baseOf))].filter((name) => byName.has(name));
  const read = named.length > 0 ? named.reverse() : [...byName.keys()].filter((name) => name.endsWith(".mtl"));
  const materials = new Map<string, Material>();
  for (const name of read) await readMaterials(await byName.get(name)!.text(), materials);
  return materials;
}

/** Of the files that were chosen with an OBJ: the MTL files, and the images that they name. */
export async function materialFiles(chosen: readonly File[]): Promise<File[]> {
  const named = new Set<string>();
  const isText = ({ name }: File) => /\.mtl$/i.test(name);
  for (const file of chosen.filter(isText)) {
    const materials = new Map<string, Material>();
    await readMaterials(await file.text(), materials);
    for (const { image } of materials.values()) if (image !== undefined) named.add(baseOf(image));
  }
  return chosen.filter((file) => isText(file) || named.has(file.name.toLowerCase()));
}

function placeOf(word: string | undefined, count: number): number {
  return word ? indexOf(word, count) : -1;
}

async function readMaterials(text: string, materials: Map<string, Material>): Promise<void> {
  let name: string | undefined;
  let lineCount = 0;
  for (const { words } of logicalLines(text)) {
    if (++lineCount % linesAtOnce === 0) await others();
    const [key, ...values] = words;
    if (key === "newmtl") materials.set((name = values.join(" ")), white);
    const material = name === undefined ? undefined : materials.get(name);
    if (!material) continue;
    if (key === "Kd") {
      const [r = NaN, g = r, b = r] = values.map(Number);
      if (r >= 0 && r <= 1 && g >= 0 && g <= 1 && b >= 0 && b <= 1) {
        materials.set(name!, { ...material, colour: [linear(r), linear(g), linear(b)] });
      }
    }
    if (key?.toLowerCase() === "map_kd") {
      const { file, isClamped } = mapOf(values);
      materials.set(name!, { ...material, image: file, isRepeated: !isClamped });
    }
  }
}

/** How many values an option of a map has, at most. */
const optionValues: Readonly<Record<string, number>> = {
  "-blendu": 1,
  "-blendv": 1,
  "-bm": 1,
  "-boost": 1,
  "-cc": 1,
  "-clamp": 1,
  "-imfchan": 1,
  "-mm": 2,
  "-o": 3,
  "-s": 3,
  "-t": 3,
  "-texres": 1,
};

/** The file is what follows the options; its name may have spaces. */
function mapOf(values: readonly string[]): { file: string; isClamped: boolean } {
  let at = 0;
  let isClamped = false;
  while (Object.hasOwn(optionValues, values[at] ?? "")) {
    const option = values[at++]!;
    if (option === "-clamp") isClamped = values[at] === "on";
    const isOneWord = optionValues[option] === 1;
    for (let k = 0; k < optionValues[option]! && at < values.length - 1; ++k, ++at) {
      if (!isOneWord && Number.isNaN(Number(values[at]))) break; // “-s 1 wood.png”
    }
  }
  return { file: values.slice(at).join(" "), isClamped };
}

/** A file's name in small letters. Whatever folders a file names: files are opened without them. */
function baseOf(path: string): string {
  return path.split(/[\\/]/).at(-1)!.toLowerCase();
}

/** From sRGB. */
function linear(value: number): number {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}
