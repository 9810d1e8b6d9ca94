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
  const lines = text.split(text.includes("\n") ? "\n" : "\r");
  for (let k = 0; k < lines.length; ++k) {
    let line = lines[k]!;
    while (/\\\r?$/.test(line) && k + 1 < lines.length) line = `${line}\n${lines[++k]!}`;
    const plain = line.replace(/\\\r?\n/g, " ").replace(/(^|\s)#.*/s, "");
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
