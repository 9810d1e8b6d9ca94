import { type Tag, XmlText } from "./xml.js";

// The reader of three.js knows elements by their whole names, and the XML of a worker stops at some DOCTYPEs. So both are taken out of
// a COLLADA file. Each line stays what it is.

/**
 * The file without its DOCTYPE, without the prefixes that are bound to COLLADA, and without elements whose prefix is bound to something
 * else. Throws a FileFault, also where nothing declares a prefix.
 */
export function plainDae(name: string, text: string): string {
  return withoutPrefixes(name, withoutDoctype(name, text));
}

const blank = (text: string) => text.replace(/[^\r\n]/g, " ");

function withoutDoctype(name: string, text: string): string {
  const begin = doctypeIn(text);
  if (begin < 0) return text;
  const xml = new XmlText(name, text);
  const end = doctypeEnd(xml, begin);
  const plain = text.slice(0, begin) + blank(text.slice(begin, end)) + text.slice(end);
  const second = doctypeIn(plain);
  if (second >= 0) throw xml.fault(second, "this is a second DOCTYPE, and a file has one at most");
  return plain;
}

/** Where it begins, before the first element; −1 if there is none. */
function doctypeIn(text: string): number {
  for (let at = text.indexOf("<"); at >= 0; at = text.indexOf("<", at)) {
    if (text.startsWith("<!DOCTYPE", at)) return at;
    const end = text.startsWith("<!--", at) ? "-->" : text.startsWith("<?", at) ? "?>" : undefined;
    const found = end === undefined ? -1 : text.indexOf(end, at);
    if (found < 0) return -1;
    at = found;
  }
  return -1;
}

const declared: Readonly<Record<string, string>> = { "<!ENTITY": "an entity", "<!ATTLIST": "attributes" };

function doctypeEnd(xml: XmlText, begin: number): number {
  const { text } = xml;
  const mark = /<!--|<\?|<!ENTITY|<!ATTLIST|["'[\]>]/g;
  mark.lastIndex = begin;
  let isInner = false; // between its brackets
  for (let found = mark.exec(text); found; found = mark.exec(text)) {
    const [piece] = found;
    const what = declared[piece];
    if (what) throw xml.fault(found.index, `the DOCTYPE declares ${what} (${piece}), which this page does not read`);
    if (piece === ">" && !isInner) return mark.lastIndex;
    if (piece === "[" || piece === "]") isInner = piece === "[";
    const closing = piece === "<!--" ? "-->" : piece === "<?" ? "?>" : /["']/.test(piece) ? piece : undefined;
    if (closing === undefined) continue;
    const end = text.indexOf(closing, mark.lastIndex);
    if (end < 0) throw xml.fault(found.index, `${piece} has no ${closing} after it`);
    mark.lastIndex = end + closing.length;
  }
  throw xml.cut(`the DOCTYPE of line ${xml.lineOf(begin)}`);
}

const collada = /^https?:\/\/www\.collada\.org\//;

/** What prefixes are bound to, at the place that is read. */
class Prefixes {
  readonly #bound = new Map<string, string[]>([["xml", ["http://www.w3.org/XML/1998/namespace"]]]);
  /** Of each element that is open. */
  readonly #own: string[][] = [];

  begin({ attributes }: Tag): void {
    const own = Object.keys(attributes).flatMap((key) => /^xmlns:(.+)$/.exec(key)?.[1] ?? []);
    for (const prefix of own) {
      if (!this.#bound.has(prefix)) this.#bound.set(prefix, []);
      this.#bound.get(prefix)!.push(attributes[`xmlns:${prefix}`]!);
    }
    this.#own.push(own);
  }

  end(): void {
    for (const prefix of this.#own.pop()!) this.#bound.get(prefix)!.pop();
  }

  /** Undefined if nothing declares it. */
  of(prefix: string): string | undefined {
    return this.#bound.get(prefix)?.at(-1) || undefined;
  }
}

function withoutPrefixes(name: string, text: string): string {
  if (!/<[^\s<>"'!?/:=]+:/.test(text)) return text;
  const xml = new XmlText(name, text);
  const prefixes = new Prefixes();
  const pieces: string[] = [];
  let [end, depth, others] = [0, 0, 0]; // `others`: how deep in elements of something else
  for (const tag of xml.tags()) {
    const { prefix, isEnd, at } = tag;
    if (!isEnd) prefixes.begin(tag);
    const bound = prefixes.of(prefix);
    const isOwn = prefix === "" || collada.test(bound ?? "");
    if (!isEnd && depth === 0 && !isOwn) throw xml.fault(at, wrongRoot(tag, bound));
    if (!isEnd && prefix !== "" && bound === undefined) {
      throw xml.fault(at, `<${prefix}:${tag.name}> has the prefix “${prefix}”, which nothing declares`);
    }
    if (others === 0 && isOwn && prefix !== "" && at < tag.end) {
      const before = at + (isEnd ? 2 : 1);
      pieces.push(text.slice(end, before));
      end = before + prefix.length + 1;
    }
    if (others === 0 && !isOwn) {
      pieces.push(text.slice(end, at));
      end = at;
    }
    if (!isEnd && (others > 0 || !isOwn)) ++others;
    else if (isEnd && others > 0 && --others === 0) {
      pieces.push(blank(text.slice(end, tag.end)));
      end = tag.end;
    }
    depth += isEnd ? -1 : 1;
    if (isEnd) prefixes.end();
  }
  pieces.push(text.slice(end));
  return pieces.join("");
}

function wrongRoot({ prefix, name }: Tag, bound: string | undefined): string {
  const why = bound === undefined ? "which nothing declares" : `which is bound to “${bound}”`;
  return `the file begins with <${prefix}:${name}> and the prefix “${prefix}”, ${why}, and not to COLLADA`;
}
