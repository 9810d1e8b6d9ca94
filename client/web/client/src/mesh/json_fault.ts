const space = /[ \t\n\r]*/y;
const scalar = /(?:true|false|null|-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?)(?![\w.+-])/y;
const escape = /\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4})/y;

/** The number of the first byte, from 0 on, that cannot stand there in JSON (RFC 8259); the number of bytes if more would have to come. */
export function jsonFaultAt(bytes: Uint8Array): number {
  const text = new TextDecoder("latin1").decode(bytes); // one character for each byte
  const mark = text.startsWith("\u00ef\u00bb\u00bf") ? 3 : 0;
  /** What closes the lists and objects that are open. */
  const open: string[] = [];
  let wanted: "value" | "key" | "colon" | "end" = "value";
  let isFirst = false;
  for (let at = after(space, text, mark)!; at < text.length; at = after(space, text, at)!) {
    const letter = text[at]!;
    const closing = open.at(-1);
    const canClose = wanted === "end" || (isFirst && wanted !== "colon");
    isFirst = false;
    if (letter === closing && canClose) {
      open.pop();
      [wanted, at] = ["end", at + 1];
    } else if (wanted === "end") {
      if (letter !== "," || !closing) return at;
      [wanted, at] = [closing === "}" ? "key" : "value", at + 1];
    } else if (wanted === "colon") {
      if (letter !== ":") return at;
      [wanted, at] = ["value", at + 1];
    } else if (letter === '"') {
      const end = stringEnd(text, at + 1);
      if (text[end] !== '"') return end;
      [wanted, at] = [wanted === "key" ? "colon" : "end", end + 1];
    } else if (wanted === "key") {
      return at;
    } else if (letter === "{" || letter === "[") {
      open.push(letter === "{" ? "}" : "]");
      [wanted, at, isFirst] = [letter === "{" ? "key" : "value", at + 1, true];
    } else {
      const end = after(scalar, text, at);
      if (end === undefined) return at;
      [wanted, at] = ["end", end];
    }
  }
  return text.length;
}

/** Where what matches here ends. */
function after(pattern: RegExp, text: string, at: number): number | undefined {
  pattern.lastIndex = at;
  return pattern.test(text) ? pattern.lastIndex : undefined;
}

/** Where the closing quotation mark is, or what cannot stand in a string. */
function stringEnd(text: string, begin: number): number {
  let at = begin;
  while (at < text.length && text[at] !== '"' && text[at]! >= " ") {
    const end = text[at] === "\\" ? after(escape, text, at) : at + 1;
    if (end === undefined) return at;
    at = end;
  }
  return at;
}
