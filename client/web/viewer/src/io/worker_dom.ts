import { Document, DOMParser, Element } from "@xmldom/xmldom";

// What the readers of three.js want of a page and a worker does not have: XML, the window's size for cameras, and elements for images,
// none of which is loaded.

const attribute = /^\[(\w+)="(.*)"\]$/;

/** For selectors of the readers: names of elements, one in the other, or one attribute. */
function found(root: Document | Element, selector: string): Element[] {
  const [, name, value] = attribute.exec(selector) ?? [];
  if (name) return [...root.getElementsByTagName("*")].filter((element) => element.getAttribute(name) === value);
  let all: (Document | Element)[] = [root];
  for (const step of selector.split(" ")) all = [...new Set(all.flatMap((one) => [...one.getElementsByTagNameNS("*", step)]))];
  return all as Element[];
}

for (const { prototype } of [Document, Element]) {
  Object.assign(prototype, {
    querySelectorAll(this: Document | Element, selector: string) {
      return found(this, selector);
    },
    querySelector(this: Document | Element, selector: string) {
      return found(this, selector)[0] ?? null;
    },
  });
}

Object.assign(globalThis, {
  DOMParser,
  document: { createElementNS: () => new EventTarget() },
  window: { innerWidth: 1, innerHeight: 1 },
});
