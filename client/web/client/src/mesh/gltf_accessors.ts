import {
  type GltfDocument,
  indexOf,
  listOf,
  nameOf,
  type Part,
  partOf,
  refuse,
  viewOf,
  wholeOf,
} from "./gltf_document.js";

export const float = 5126;
const mostElements = 5_000_000;

type Load = (view: DataView, at: number) => number;

/** By componentType: bytes, what 1 is stored as if normalized, and how it is read. */
const components: Readonly<Record<number, readonly [number, number, Load]>> = {
  5120: [1, 127, (view, at) => view.getInt8(at)],
  5121: [1, 255, (view, at) => view.getUint8(at)],
  5122: [2, 32767, (view, at) => view.getInt16(at, true)],
  5123: [2, 65535, (view, at) => view.getUint16(at, true)],
  5125: [4, 1, (view, at) => view.getUint32(at, true)],
  [float]: [4, 1, (view, at) => view.getFloat32(at, true)],
};
const widths: Readonly<Record<string, number>> = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16 };

/** Where elements lie in the buffer. */
export interface Layout {
  begin: number;
  end: number;
  stride: number;
  /** Bytes of an element. */
  size: number;
  count: number;
}

function componentOf(object: Part, part: string): readonly [number, number, Load] {
  return components[object["componentType"] as number] ?? refuse(part, "has an unknown “componentType”");
}

export function countOf({ json }: GltfDocument, accessor: number): number {
  const part = nameOf(json, "accessors", accessor);
  const count = wholeOf(listOf(json, "accessors")[accessor]!, "count", 0, part);
  if (count > mostElements) refuse(part, `has ${count} elements; this page takes ${mostElements} at most`);
  return count;
}

function layoutInView({ json, buffer }: GltfDocument, owner: Part, count: number, size: number, part: string): Layout {
  const number = indexOf(json, owner["bufferView"], "bufferViews", part);
  const view = listOf(json, "bufferViews")[number]!;
  const name = nameOf(json, "bufferViews", number);
  const [from, length] = [wholeOf(view, "byteOffset", 0, name), wholeOf(view, "byteLength", 0, name)];
  const stride = wholeOf(view, "byteStride", size, name);
  if (from + length > buffer.length) refuse(name, `reaches beyond its buffer of ${buffer.length} bytes`);
  if (stride < size) refuse(name, `has a “byteStride” of ${stride} for elements of ${size} bytes`);
  const begin = from + wholeOf(owner, "byteOffset", 0, part);
  const end = count === 0 ? begin : begin + stride * (count - 1) + size;
  if (end > from + length) refuse(part, `reaches beyond the ${length} bytes of ${name}`);
  return { begin, end, stride, size, count };
}

/** Throws a FileFault if the accessor has no bufferView, or reaches beyond it. */
export function layoutOf(document: GltfDocument, accessor: number): Layout {
  const object = listOf(document.json, "accessors")[accessor]!;
  const part = nameOf(document.json, "accessors", accessor);
  const width = widths[object["type"] as string] ?? refuse(part, "has an unknown “type”");
  return layoutInView(document, object, countOf(document, accessor), width * componentOf(object, part)[0], part);
}

/** Its numbers, element by element: normalized integers as -1 to 1, values of “sparse” put in. Throws a FileFault. */
export function readNumbers(document: GltfDocument, accessor: number, width: number): Float64Array {
  const object = listOf(document.json, "accessors")[accessor]!;
  const part = nameOf(document.json, "accessors", accessor);
  if (widths[object["type"] as string] !== width) refuse(part, `must have ${width} numbers an element`);
  const [size, one, load] = componentOf(object, part);
  const view = viewOf(document.buffer);
  const layout = layoutOf(document, accessor);
  const numbers = new Float64Array(width * layout.count);
  const put = ({ begin, stride, count }: Layout, at: (k: number) => number) => {
    for (let k = 0; k < count; ++k) {
      for (let axis = 0; axis < width; ++axis)
        numbers[width * at(k) + axis] = load(view, begin + k * stride + axis * size);
    }
  };
  put(layout, (k) => k);
  if (object["sparse"] !== undefined) {
    const sparse = partOf(object["sparse"]);
    const rows = sparseRows(document, sparse, layout.count, part);
    put(
      layoutInView(document, partOf(sparse["values"]), rows.length, width * size, `“sparse” of ${part}`),
      (k) => rows[k]!,
    );
  }
  if (object["normalized"] === true && one > 1)
    numbers.forEach((number, k) => (numbers[k] = Math.max(number / one, -1)));
  return numbers;
}

function sparseRows(document: GltfDocument, sparse: Part, most: number, owner: string): number[] {
  const part = `“sparse” of ${owner}`;
  const indices = partOf(sparse["indices"]);
  const count = wholeOf(sparse, "count", 0, part);
  if (count > most) refuse(part, `has ${count} values for ${most} elements`);
  const [size, , load] = componentOf(indices, part);
  const { begin, stride } = layoutInView(document, indices, count, size, part);
  const view = viewOf(document.buffer);
  return Array.from({ length: count }, (_, k) => {
    const row = load(view, begin + k * stride);
    return row < most ? row : refuse(part, `names element ${row} of ${most}`);
  });
}
