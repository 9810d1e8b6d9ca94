import { FileFault } from "lpdeform-client/mesh/fault";
import { checkCopies, type Use } from "./uses.js";
import { isNumber, type Tag, XmlText } from "./xml.js";

// What a 3MF file has that the reader of three.js would leave out or tear without a word is refused by its part and line. Vertices and
// triangles count from 0, as the file does.

/** Groups of colours that the reader knows, and what stands in them. */
const groupKinds: Readonly<Record<string, string>> = {
  basematerials: "base",
  colorgroup: "color",
  texture2dgroup: "tex2coord",
};
const rootPart = /^3D\/[^/]*\.model$/;
const anyPart = /^3D\/.*\.model$/;
const relationships = /_rels\/\.rels$/;

/** Throws a FileFault. */
export async function check3mf(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<void> {
  const parts = await partsOf(name, bytes);
  const rels = parts.find(([part]) => relationships.test(part));
  if (!rels) throw new FileFault(`${name} has no part “_rels/.rels”.`);
  if (!parts.some(([part]) => rootPart.test(part))) {
    throw new FileFault(`${name} has no model, which is a part such as “3D/3dmodel.model”.`);
  }
  const xmlOf = ([part, data]: [string, Uint8Array]) => new XmlText(`${name}, ${part}`, new TextDecoder().decode(data));
  const objects = new Map<string, string>();
  const uses: Use[] = [];
  for (const one of parts) if (anyPart.test(one[0])) new Model(xmlOf(one), one[0], objects, uses).check();
  const names = parts.map(([part]) => part);
  checkRelationships(xmlOf(rels), new Set(names));
  checkUses(objects, uses);
}

/** A damaged one is named. */
async function partsOf(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<[string, Uint8Array][]> {
  const { unzipSync } = await import("three/addons/libs/fflate.module.js");
  let last = "";
  const note = ({ name: part }: { name: string }) => {
    last = part;
    return true;
  };
  try {
    return Object.entries(unzipSync(bytes, { filter: note }));
  } catch {
    throw new FileFault(`${name}: its part “${last}” is damaged.`);
  }
}

function checkRelationships(xml: XmlText, parts: ReadonlySet<string>): void {
  for (const { name, attributes, isEnd, at } of xml.tags()) {
    const target = attributes["Target"] ?? "";
    if (isEnd || name !== "Relationship" || !/\.model$/i.test(target)) continue;
    if (parts.has(target.slice(1))) return;
    throw xml.fault(at, `<Relationship> names the part “${target}”, which is not in the file`);
  }
  throw new FileFault(`${xml.name} names no model.`);
}

function checkUses(objects: ReadonlyMap<string, string>, uses: readonly Use[]): void {
  for (const { xml, at, name, object } of uses) {
    if (!objects.has(object)) throw xml.fault(at, `<${name}> names the object “${object}”, which is not in the file`);
  }
  checkCopies("object", uses, uses);
}

/** The object that is being read. */
interface Reading {
  id: string;
  at: number;
  hasContents: boolean;
  vertexCount: number;
  triangleCount: number;
  /** Of its triangles: the one with the largest index of a vertex. */
  most: { vertex: number; triangle: number; at: number };
  group: string | undefined;
  /** Whether a triangle has a group of its own, and the first that has none. */
  hasGroups: boolean;
  plain?: { triangle: number; at: number };
}

/** One model part. */
class Model {
  /** Of each group, how many entries it has. */
  readonly #groups = new Map<string, number>();
  #group = "";
  /** Of each group that is named, where its largest entry is. */
  readonly #named = new Map<string, { at: number; what: string; entry: number }>();
  #object: Reading | undefined;
  #hasBuild = false;
  #itemCount = 0;

  /** `objects`: by its id, the part of each object. It and `uses` grow. */
  constructor(
    readonly xml: XmlText,
    readonly part: string,
    readonly objects: Map<string, string>,
    readonly uses: Use[],
  ) {}

  check(): void {
    let isFirst = true;
    for (const tag of this.xml.tags()) {
      const { name, isEnd, at } = tag;
      if (isFirst && name !== "model") throw this.xml.fault(at, `the part begins with <${name}>, and a model with <model>`);
      isFirst = false;
      if (!isEnd) this.#begin(tag);
      else if (name === "object") this.#endObject();
    }
    this.#checkGroups();
    if (!rootPart.test(this.part)) return;
    if (!this.#hasBuild) throw new FileFault(`${this.xml.name} has no <build>, which says what is made.`);
    if (this.#itemCount === 0) throw new FileFault(`${this.xml.name} has no <item> in its <build>: nothing is made.`);
  }

  #begin(tag: Tag): void {
    const { name, attributes, at } = tag;
    if (Object.hasOwn(groupKinds, name)) this.#groups.set((this.#group = attributes["id"] ?? ""), 0);
    if (Object.values(groupKinds).includes(name)) this.#groups.set(this.#group, 1 + (this.#groups.get(this.#group) ?? 0));
    if (name === "build") this.#hasBuild = true;
    if (name === "item") ++this.#itemCount;
    if (name === "item" || name === "component") {
      this.uses.push({ xml: this.xml, at, name, object: attributes["objectid"] ?? "", by: this.#object?.id });
      checkTransform(this.xml, tag);
    }
    if (name === "object") this.#beginObject(tag);
    if (!this.#object) return;
    if (name === "mesh" || name === "components") this.#object.hasContents = true;
    if (name === "vertex") this.#vertex(tag, this.#object);
    if (name === "triangle") this.#triangle(tag, this.#object);
  }

  #beginObject({ attributes, at }: Tag): void {
    const { id = "", pid, pindex } = attributes;
    const outer = this.#object;
    if (outer) {
      throw this.xml.fault(at, `the object “${id}” stands in the object “${outer.id}” of line ${this.xml.lineOf(outer.at)}`);
    }
    const other = this.objects.get(id);
    if (other !== undefined) throw this.xml.fault(at, `the object “${id}” is in the file twice, the other time in ${other}`);
    this.objects.set(id, this.part);
    const most = { vertex: -1, triangle: 0, at };
    this.#object = { id, at, hasContents: false, vertexCount: 0, triangleCount: 0, most, group: pid, hasGroups: false };
    if (pid) this.#name(pid, [pindex], at, () => `the object “${id}”`);
  }

  #name(id: string, entries: readonly (string | undefined)[], at: number, what: () => string): void {
    const entry = Math.max(0, ...entries.map((one) => Number(one ?? 0)));
    const known = this.#named.get(id);
    if (!known || entry > known.entry) this.#named.set(id, { at, what: what(), entry });
  }

  #checkGroups(): void {
    for (const [id, { at, what, entry }] of this.#named) {
      const count = this.#groups.get(id);
      if (count === undefined) {
        const kinds = Object.keys(groupKinds).join(">, <");
        throw this.xml.fault(at, `${what} names the group “${id}”, which is no <${kinds}> of the part`);
      }
      if (entry < count) continue;
      throw this.xml.fault(at, `${what} names entry ${entry} of the group “${id}”; there are ${count}, counted from 0`);
    }
  }

  #vertex({ attributes, at }: Tag, object: Reading): void {
    const { x = "", y = "", z = "" } = attributes;
    if (!isNumber(x) || !isNumber(y) || !isNumber(z)) {
      const what = `vertex ${object.vertexCount} of the object “${object.id}”`;
      throw this.xml.fault(at, `${what} has “${x}”, “${y}” and “${z}”, which are not three finite numbers`);
    }
    ++object.vertexCount;
  }

  #triangle({ attributes, at }: Tag, object: Reading): void {
    const { pid, p1, p2, p3 } = attributes;
    const triangle = object.triangleCount++;
    const what = () => `triangle ${triangle} of the object “${object.id}”`;
    for (const key of ["v1", "v2", "v3"]) {
      const word = attributes[key] ?? "";
      if (!/^\d+$/.test(word)) throw this.xml.fault(at, `${what()} has the ${key} “${word}”, which is no vertex`);
      if (Number(word) > object.most.vertex) object.most = { vertex: Number(word), triangle, at };
    }
    if (pid) object.hasGroups = true;
    else object.plain ??= { triangle, at };
    const group = pid ?? object.group;
    if (group) this.#name(group, [p1, p2, p3], at, what);
  }

  #endObject(): void {
    const { id, at, hasContents, vertexCount, most, group, hasGroups, plain } = this.#object!;
    this.#object = undefined;
    if (!hasContents) throw this.xml.fault(at, `the object “${id}” has neither a <mesh> nor <components>`);
    if (most.vertex >= vertexCount) {
      const what = `triangle ${most.triangle} of the object “${id}”`;
      throw this.xml.fault(most.at, `${what} has vertex ${most.vertex}; there are ${vertexCount}, counted from 0`);
    }
    if (!group && hasGroups && plain) {
      const what = `triangle ${plain.triangle} of the object “${id}”`;
      throw this.xml.fault(plain.at, `${what} has no pid, nor has the object, and other triangles have one`);
    }
  }
}

function checkTransform(xml: XmlText, { name, attributes, at }: Tag): void {
  const { transform } = attributes;
  if (transform === undefined) return;
  const words = transform.split(" ").slice(0, 12); // as the reader does
  if (words.length === 12 && words.every(isNumber)) return;
  throw xml.fault(at, `<${name}> has the transform “${transform}”, which is not 12 numbers with one blank between them`);
}
