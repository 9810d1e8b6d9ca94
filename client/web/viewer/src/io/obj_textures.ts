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

const white: Material = { colour: [1, 1, 1], image: undefined, isRepeated: true };

/**
 * The diffuse images and colours of an OBJ file (“map_Kd” and “Kd” of its MTL files), for what readObj() reads of it. Images that are
 * named and were not opened with it are listed as missing. Rejects if the browser no longer has a file.
 */
export async function readObjTextures(obj: Uint8Array, files: MaterialFiles): Promise<Texturing> {
  const texts = Object.keys(files).filter((name) => /\.mtl$/i.test(name));
  const materials = new Map<string, Material>();
  for (const name of texts) readMaterials(await files[name]!.text(), materials);
  const coordinates: number[] = [];
  const corners: number[] = [];
  const layers: (TextureLayer & { firstFace: number; faceCount: number })[] = [];
  const missing = new Set<string>();
  let present = "";
  let last: string | undefined;
  for (const { words } of logicalLines(new TextDecoder().decode(obj))) {
    const [key, ...values] = words;
    if (key === "vt") coordinates.push(Number(values[0] ?? 0), 1 - Number(values[1] ?? 0));
    if (key === "usemtl") present = values.join(" ");
    if (key !== "f") continue;
    const places = values.map((word) => placeOf(word.split("/")[1], coordinates.length / 2));
    for (let k = 2; k < places.length; ++k) corners.push(places[0]!, places[k - 1]!, places[k]!);
    if (present !== last) {
      const material = materials.get(present) ?? white;
      const image = material.image === undefined ? undefined : fileOf(files, material.image);
      if (material.image !== undefined && !image) missing.add(material.image);
      const { colour, isRepeated } = material;
      layers.push({
        firstFace: corners.length / 3 - (places.length - 2),
        faceCount: 0,
        colour,
        isRepeated,
        ...(image && { image }),
      });
      last = present;
    }
    layers.at(-1)!.faceCount += places.length - 2;
  }
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

function placeOf(word: string | undefined, count: number): number {
  return word ? indexOf(word, count) : -1;
}

function readMaterials(text: string, materials: Map<string, Material>): void {
  let name: string | undefined;
  for (const { words } of logicalLines(text)) {
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

/** Whatever folders an MTL names: files are opened without them. */
function fileOf(files: MaterialFiles, path: string): Blob | undefined {
  const wanted = path.split(/[\\/]/).at(-1)!.toLowerCase();
  const name = Object.keys(files).find((one) => one.toLowerCase() === wanted);
  return name === undefined ? undefined : files[name];
}

/** From sRGB. */
function linear(value: number): number {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}
