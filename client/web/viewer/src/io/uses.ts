import type { XmlText } from "./xml.js";

/** A place in a file where an object is used. */
export interface Use {
  xml: XmlText;
  at: number;
  /** Of the element. */
  name: string;
  object: string;
  /** The object in which it stands, if any. */
  by: string | undefined;
}

const mostCopies = 100_000;

/**
 * Throws a FileFault if an object is a part of itself, or where the copies become too many. Each of `copies` is a copy of an object, with
 * a copy of all that `uses` has in it. `kind` is what an object is called.
 */
export function checkCopies(kind: string, uses: readonly Use[], copies: readonly Use[]): void {
  const parts = new Map<string, Use[]>();
  for (const use of uses) {
    if (use.by === undefined) continue;
    if (!parts.has(use.by)) parts.set(use.by, []);
    parts.get(use.by)!.push(use);
  }
  const counts = new Map<string, number | "open">();
  const countOf = ({ xml, at, object }: Use): number => {
    const known = counts.get(object);
    if (known === "open") throw xml.fault(at, `the ${kind} “${object}” is a part of itself`);
    if (known !== undefined) return known;
    counts.set(object, "open");
    let count = 1;
    for (const part of parts.get(object) ?? []) count += countOf(part);
    counts.set(object, count);
    return count;
  };
  for (const use of uses) countOf(use);
  let count = 0;
  for (const use of copies) {
    count += countOf(use);
    if (count <= mostCopies) continue;
    const what = `with the ${kind} “${use.object}” and all its parts, more than ${mostCopies} copies are made`;
    throw use.xml.fault(use.at, `${what}; that is the limit for a file`);
  }
}
