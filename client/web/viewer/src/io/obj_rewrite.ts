import type { Mesh } from "lpdeform-client/mesh/mesh";
import { cornerOf, indexOf, logicalLines } from "lpdeform-client/mesh/obj_lines";
import { byteOrderMark, bytesOfText, byteText } from "./byte_text.js";
import { type Numbers, NormalTurner } from "./turned_normals.js";

/**
 * The OBJ file with new positions. All lines stay as they are except vertices (whatever follows their three numbers stays) and
 * normals, which turn with the surface; names stay in the encoding that they have. Several vertices may share a normal, so each pair gets a normal of its own.
 */
export function rewriteObj(
  { obj, positions: drawn, exact, faces }: Mesh & { obj: Uint8Array },
  positions: Numbers,
): Uint8Array<ArrayBuffer> {
  const turner = new NormalTurner(exact ?? drawn, positions, faces);
  const normals: number[][] = [];
  const pairs = new Map<string, number>();
  const newNormals: string[] = [];
  const whole = byteText(obj);
  const mark = whole.startsWith(byteOrderMark) ? byteOrderMark : "";
  const source = whole.slice(mark.length);
  const separator = source.includes("\n") ? "\n" : "\r";
  const before = source.includes("\r\n") ? "\r" : "";
  const out: string[] = [];
  let vertexCount = 0;
  let firstFace: number | undefined;

  const withNormal = (word: string): string => {
    const [vertex, texture, normal] = word.split("/");
    if (!normal) return word;
    const at = indexOf(normal, normals.length);
    const from = normals[at];
    if (!from) return word;
    const corner = cornerOf(vertex!, vertexCount);
    const key = `${corner} ${at}`;
    let number = pairs.get(key);
    if (number === undefined) {
      number = newNormals.push(`vn ${turner.turned(corner, from).map(shortest).join(" ")}${before}`);
      pairs.set(key, number);
    }
    return `${vertex}/${texture}/${number}`;
  };

  for (const { text, words } of logicalLines(source)) {
    const [key, ...values] = words;
    const end = text.endsWith("\r") ? "\r" : "";
    if (key === "v") {
      const place = [0, 1, 2].map((axis) => String(positions[3 * vertexCount + axis]));
      out.push(["v", ...place, ...values.slice(3)].join(" ") + end);
      ++vertexCount;
    } else if (key === "vn") {
      normals.push(values.slice(0, 3).map(Number));
    } else if (key === "f") {
      firstFace ??= out.push("") - 1;
      out.push(values.some((word) => /\/.*\/./.test(word)) ? ["f", ...values.map(withNormal)].join(" ") + end : text);
    } else {
      out.push(text);
    }
  }
  if (firstFace !== undefined) out.splice(firstFace, 1, ...newNormals);
  return bytesOfText(mark + out.join(separator));
}

/** Enough digits for a direction. */
function shortest(value: number): string {
  return String(Number(value.toPrecision(7)));
}
