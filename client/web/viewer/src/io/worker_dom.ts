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
  const { getElementsByTagName } = prototype;
  Object.assign(prototype, {
    /** As they are now. Those of xmldom are all sought again when an element gets an attribute, as each node without an id does. */
    getElementsByTagName(this: Document | Element, name: string) {
      return [...getElementsByTagName.call(this, name)];
    },
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
