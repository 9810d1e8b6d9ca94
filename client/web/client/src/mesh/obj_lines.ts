/** A line of an OBJ file, including the lines that a backslash at its end continues. */
export interface ObjLine {
  /** As in the file, without the line's end. */
  text: string;
  /** The words before a comment. */
  words: string[];
  /** The number of its last line in the file, from 1. */
  number: number;
}

export function* logicalLines(text: string): Generator<ObjLine> {
  const separator = text.includes("\n") ? "\n" : "\r";
  const lines = text.split(separator);
  for (let k = 0; k < lines.length; ++k) {
    const begin = k;
    while (/\\\r?$/.test(lines[k]!) && k + 1 < lines.length) ++k;
    const line = k === begin ? lines[k]! : lines.slice(begin, k + 1).join(separator);
    const plain = line.replace(/\\(?:\r?\n|\r)/g, " ").replace(/(^|\s)#.*/s, "");
    const words = plain.split(/\s+/).filter((word) => word !== "");
    yield { text: line, words, number: k + 1 };
  }
}

/** The vertex of a corner such as "7/8/9": numbers count from 1, negative ones back from the newest. */
export function cornerOf(word: string, vertexCount: number): number {
  return indexOf(word.split("/")[0]!, vertexCount);
}

export function indexOf(word: string, count: number): number {
  const number = Number(word);
  return number < 0 ? count + number : number - 1;
}
