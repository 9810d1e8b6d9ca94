import { layoutOf } from "lpdeform-client/mesh/gltf_accessors";
import { readBlocks } from "lpdeform-client/mesh/gltf_blocks";
import { bytesAt, type GltfDocument, listOf, type Part, partOf } from "lpdeform-client/mesh/gltf_document";

const changed = ["POSITION", "NORMAL", "TANGENT"];

type Files = ReadonlyMap<string, Uint8Array>;

/**
 * What of a glTF is otherwise after its mesh was deformed than before, though only positions, normals and tangents may be. Images of
 * `beside`, which the file named, may lie in it now.
 */
export function lostIn(before: GltfDocument, after: GltfDocument, beside: Files = new Map()): string[] {
  const found = otherBytes(before, after);
  const keys = new Set([...Object.keys(before.json), ...Object.keys(after.json)]);
  for (const key of keys) {
    const [was, is] = [before.json[key], after.json[key]];
    const isList = ["accessors", "bufferViews", "meshes", "nodes", "buffers"].includes(key);
    const same =
      key === "images"
        ? sameImages(before, after, beside)
        : isList
          ? kept(key, listOf(before.json, key), listOf(after.json, key))
          : text(was) === text(is);
    if (!same) found.push(`“${key}” differs`);
  }
  return found;
}

function sameImages(before: GltfDocument, after: GltfDocument, beside: Files): boolean {
  const [were, are] = [before, after].map((document) =>
    listOf(document.json, "images").map(({ uri, bufferView, mimeType: _, ...rest }) => {
      const bytes = bufferView === undefined ? bytesAt(uri, beside) : bytesOf(document, bufferView as number);
      return { rest, image: bytes ? Buffer.from(bytes).toString("base64") : uri };
    }),
  );
  return text(were) === text(are);
}

/** The bytes of everything but those attributes; new ones may follow. */
function otherBytes(before: GltfDocument, after: GltfDocument): string[] {
  const free = new Uint8Array(before.buffer.length);
  for (const { position, normal, tangent } of readBlocks(before).blocks) {
    for (const accessor of [position, normal, tangent].filter((one) => one !== undefined)) {
      if (listOf(before.json, "accessors")[accessor]!["bufferView"] === undefined) continue;
      const { begin, stride, size, count } = layoutOf(before, accessor);
      for (let k = 0; k < count; ++k) free.fill(1, begin + k * stride, begin + k * stride + size);
    }
  }
  return listOf(before.json, "bufferViews").flatMap((view, k) => {
    const [was, is] = [bytesOf(before, k), bytesOf(after, k)];
    const begin = (view["byteOffset"] ?? 0) as number;
    const other = was.findIndex((byte, at) => free[begin + at] === 0 && is[at] !== byte);
    return other < 0 ? [] : [`byte ${other} of bufferView ${k} differs`];
  });
}

function bytesOf({ json, buffer }: GltfDocument, view: number): Uint8Array {
  const { byteOffset = 0, byteLength = 0 } = listOf(json, "bufferViews")[view] ?? {};
  return buffer.subarray(byteOffset as number, (byteOffset as number) + (byteLength as number));
}

/** Whether a list begins as it was, but for what a deformed mesh needs. */
function kept(key: string, before: readonly Part[], after: readonly Part[]): boolean {
  const bare = (item: Part | undefined) => {
    const { min: _, max: __, byteLength: ___, ...rest } = item ?? {};
    if (key === "accessors") return rest;
    if (key === "buffers") return { ...rest, uri: undefined };
    if (key === "bufferViews") return { ...item, byteOffset: undefined };
    if (key === "nodes") return { ...item, mesh: undefined };
    if (key !== "meshes") return item;
    const primitives = listOf(item!, "primitives").map((primitive) => ({
      ...primitive,
      attributes: Object.entries(partOf(primitive["attributes"])).filter(([name]) => !changed.includes(name)),
    }));
    return { ...item, primitives };
  };
  return after.length >= before.length && before.every((item, k) => text(bare(item)) === text(bare(after[k])));
}

/** In one order of keys. */
function text(value: unknown): string {
  return JSON.stringify(value, (_, inner: unknown) =>
    typeof inner === "object" && inner !== null && !Array.isArray(inner)
      ? Object.fromEntries(Object.entries(inner).sort(([a], [b]) => (a < b ? -1 : 1)))
      : inner,
  ) as string;
}
