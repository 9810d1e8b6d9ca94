import { FileFault } from "lpdeform-client/mesh/fault";

// As much of XML as is needed to say in which line of a file something is wrong. The readers of three.js have it read again.

export interface Tag {
  /** Without its prefix. */
  name: string;
  /** Empty if it has none. */
  prefix: string;
  attributes: Readonly<Record<string, string>>;
  /** Whether it is the end of an element; an element without contents has both a beginning and an end. */
  isEnd: boolean;
  /** Where it begins and ends in the text. */
  at: number;
  end: number;
}

export interface Element extends Tag {
  children: Element[];
  /** Where its end tag ends. */
  closed: number;
  /** What stands in it, as a reader of XML gives it; none if there are elements. */
  text: string;
}

const tag = /<(\/?)([^\s/>!?<]+)(?=[\s/>])((?:[^"'<>]|"[^"<]*"|'[^'<]*')*)>/y;
const attribute = /(?<=^|[\s"'])([^\s="']+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g;
/** What is no element, by its beginning, and its end. */
const others = [
  ["<!--", "-->"],
  ["<![CDATA[", "]]>"],
  ["<?", "?>"],
  ["<!", ">"],
] as const;

/** Elements in each other. In a worker of Chromium the readers of three.js run out of stack between 700 and 850. */
const mostDepth = 500;

export class XmlText {
  /** `name`: of the file, and of the part of it. */
  constructor(
    readonly name: string,
    readonly text: string,
  ) {}

  fault(at: number, what: string): FileFault {
    return new FileFault(`${this.name}, line ${this.lineOf(at)}: ${what}.`);
  }

  cut(what: string): FileFault {
    return new FileFault(`${this.name} ends too soon: ${what} has no end.`);
  }

  lineOf(at: number): number {
    return this.text.slice(0, at).split(/\r\n?|\n/).length;
  }

  /** Throws a FileFault where an element does not end. */
  *tags(): Generator<Tag> {
    const { text } = this;
    const open: { name: string; at: number }[] = [];
    let hasRoot = false;
    for (let at = text.indexOf("<"); at >= 0; at = text.indexOf("<", at)) {
      const isOther = text[at + 1] === "!" || text[at + 1] === "?";
      const other = isOther && others.find(([begin]) => text.startsWith(begin, at));
      if (other) {
        if (other[0] === "<!") this.#checkDoctype(at, hasRoot);
        const end = text.indexOf(other[1], at + other[0].length);
        if (end < 0) throw this.fault(at, `${other[0]} has no ${other[1]} after it`);
        at = end + other[1].length;
        continue;
      }
      tag.lastIndex = at;
      const [whole, slash, full, inner] = tag.exec(text) ?? [];
      if (whole === undefined && text.indexOf(">", at) < 0) throw this.cut(`the tag of line ${this.lineOf(at)}`);
      if (whole === undefined) throw this.fault(at, "the tag that begins here is broken");
      const colon = full!.indexOf(":");
      const [prefix, name] = [full!.slice(0, Math.max(colon, 0)), full!.slice(colon + 1)];
      const end = at + whole.length;
      if (slash) {
        const begin = open.pop();
        if (begin?.name !== full) {
          throw this.fault(at, `</${full}> ends ${begin ? `<${begin.name}> of line ${this.lineOf(begin.at)}` : "nothing"}`);
        }
        yield { name, prefix, attributes: {}, isEnd: true, at, end };
      } else {
        const attributes = attributesIn(inner!);
        if (hasRoot && open.length === 0) throw this.fault(at, `<${full}> comes after the end of the XML`);
        if (open.length >= mostDepth) {
          throw this.fault(at, `<${full}> lies in ${mostDepth} other elements; this page reads no deeper`);
        }
        hasRoot = true;
        yield { name, prefix, attributes, isEnd: false, at, end };
        if (inner!.endsWith("/")) yield { name, prefix, attributes, isEnd: true, at: end, end };
        else open.push({ name: full!, at });
      }
      at = end;
    }
    const last = open.at(-1);
    if (last) throw this.cut(`<${last.name}> of line ${this.lineOf(last.at)}`);
  }

  /** Throws a FileFault if what begins with “<!” is no DOCTYPE, or comes after the first element. */
  #checkDoctype(at: number, hasRoot: boolean): void {
    const [mark] = /^<!\w*/.exec(this.text.slice(at, at + 20))!;
    if (/^<!doctype$/i.test(mark) && mark !== "<!DOCTYPE") throw this.fault(at, `${mark} must be in capitals: <!DOCTYPE`);
    if (mark !== "<!DOCTYPE") throw this.fault(at, `${mark} cannot stand here`);
    if (hasRoot) throw this.fault(at, "a DOCTYPE can stand before the first element only");
  }

  /** The outermost element. Throws a FileFault if there is none. */
  root(): Element {
    const top = { children: [] as Element[] };
    const open: { children: Element[] }[] = [top];
    for (const tag of this.tags()) {
      if (tag.isEnd) {
        const element = open.pop() as Element;
        element.closed = tag.end;
        if (element.children.length === 0) element.text = plainText(this.text.slice(element.end, tag.at));
      } else {
        const element = { ...tag, children: [], closed: tag.end, text: "" };
        open.at(-1)!.children.push(element);
        open.push(element);
      }
    }
    if (!top.children[0]) throw new FileFault(`${this.name} has no XML element.`);
    return top.children[0];
  }
}

function attributesIn(text: string): Record<string, string> {
  const found: Record<string, string> = {};
  attribute.lastIndex = 0;
  for (let one = attribute.exec(text); one; one = attribute.exec(text)) found[one[1]!] = plainText(one[2] ?? one[3]!);
  return found;
}

const references: Readonly<Record<string, string>> = { lt: "<", gt: ">", amp: "&", quot: '"', apos: "'" };

/** Without comments and instructions. References to characters become these; those to what the file itself defines stay. */
function plainText(text: string): string {
  if (!/[<&]/.test(text)) return text;
  const special = /<!--.*?-->|<!\[CDATA\[(.*?)\]\]>|<\?.*?\?>|<!.*?>|&(?:#x([\da-fA-F]{1,6})|#(\d{1,7})|(\w+));/gs;
  return text.replace(special, (whole: string, data?: string, hex?: string, decimal?: string, name?: string) => {
    if (name !== undefined) return Object.hasOwn(references, name) ? references[name]! : whole;
    if (hex === undefined && decimal === undefined) return data ?? "";
    const code = hex === undefined ? Number(decimal) : parseInt(hex, 16);
    return code <= 0x10ffff ? String.fromCodePoint(code) : whole;
  });
}

export const child = (element: Element, name: string): Element | undefined => element.children.find((one) => one.name === name);

export const childrenOf = (element: Element, name: string): Element[] => element.children.filter((one) => one.name === name);

/** An element and all that stand in it, but for those of the names `without` and what stands in them. */
export function* elementsIn(element: Element, without: readonly string[]): Generator<Element> {
  if (without.includes(element.name)) return;
  yield element;
  for (const child of element.children) yield* elementsIn(child, without);
}

export const wordsOf = (text: string): string[] =>
  text
    .trim()
    .split(/\s+/)
    .filter((word) => word !== "");

/** Whether it is a finite number. */
export const isNumber = (word: string): boolean => word.trim() !== "" && Number.isFinite(Number(word));
