import type { Mesh } from "lpdeform-client/mesh/mesh";
import { cornerOf, indexOf, logicalLines } from "lpdeform-client/mesh/obj_lines";
import { byteOrderMark, bytesOfText, byteText } from "./byte_text.js";
import { type Numbers, NormalTurner } from "./turned_normals.js";

/**
 * The OBJ file with new positions. Everything stays as it is, comments and blanks too, except the three numbers of vertices, and
 * normals, which turn with the surface; names stay in the encoding that they have. Several vertices may share a normal, so each
 * pair gets a normal of its own, and all of these stand before the first face. A corner whose normal is not in the file gets none.
 */
export function rewriteObj(
  { obj, positions: drawn, exact, faces }: Mesh & { obj: Uint8Array },
  positions: Numbers,
): Uint8Array<ArrayBuffer> {
  const turner = new NormalTurner(exact ?? drawn, positions, faces);
  const pairs = new Map<string, number>();
  const newNormals: string[] = [];
  const whole = byteText(obj);
  const mark = whole.startsWith(byteOrderMark) ? byteOrderMark : "";
  const source = whole.slice(mark.length);
  const separator = source.includes("\n") ? "\n" : "\r";
  const before = source.includes("\r\n") ? "\r" : "";
  const out: string[] = [];
  const normals = normalsOf(source);
  let [vertexCount, normalCount] = [0, 0];
  let firstFace: number | undefined;

  const withNormal = (word: string): string => {
    const [vertex, texture, normal] = word.split("/");
    if (!normal) return word;
    const at = indexOf(normal, normalCount);
    const from = normals[at];
    if (!from) return texture ? `${vertex}/${texture}` : vertex!; // the file has no such normal, and may have one now
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
    if (key === "v") {
      const place = [0, 1, 2].map((axis) => String(positions[3 * vertexCount + axis]));
      out.push(withValues(text, place));
      ++vertexCount;
    } else if (key === "vn") {
      ++normalCount;
    } else if (key === "f") {
      firstFace ??= out.push("") - 1;
      out.push(values.some((word) => /\/.*\/./.test(word)) ? withValues(text, values.map(withNormal)) : text);
    } else {
      out.push(text);
    }
  }
  if (firstFace !== undefined) out.splice(firstFace, 1, ...newNormals);
  return bytesOfText(mark + out.join(separator));
}

/** Of the whole file: a face may name normals that come after it. */
function normalsOf(source: string): number[][] {
  const normals: number[][] = [];
  for (const { words } of logicalLines(source)) {
    if (words[0] === "vn") normals.push(words.slice(1, 4).map(Number));
  }
  return normals;
}

/** The line with these in place of the words that follow its keyword. All between and after them stays. */
function withValues(text: string, values: readonly string[]): string {
  let at = -1;
  return text.replace(wordsOfLine, (word) => (++at > 0 && at <= values.length ? values[at - 1]! : word));
}

/** A backslash at the end of a line continues it and is no word. */
const wordsOfLine = /(?:(?!\\[\r\n])\S)+/g;

/** Enough digits for a direction. */
function shortest(value: number): string {
  return String(Number(value.toPrecision(7)));
}
