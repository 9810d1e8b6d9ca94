import "./foreign_in_node.js";
import { FileFault } from "lpdeform-client/mesh/fault";
import { describe, expect, it } from "vitest";
import { plainDae } from "../src/io/dae_plain.js";
import { glbIn } from "../src/io/foreign_glb.js";
import { makeDae } from "./made_foreign.js";

const dae = makeDae();
const address = "http://www.collada.org/2005/11/COLLADASchema";
const glbOf = async (content: string) => new Uint8Array((await glbIn(new File([content], "a.dae"))).glb);
const wanted = await glbOf(dae);

async function refusalOf(content: string): Promise<string> {
  const thrown = await glbOf(content).catch((error: unknown) => error);
  expect(thrown).toBeInstanceOf(FileFault);
  return (thrown as FileFault).message;
}

/** The file with another piece, which must stand in it. */
function but(text: string, piece: string | RegExp, other: string): string {
  const changed = text.replace(piece, other);
  expect(changed).not.toBe(text);
  return changed;
}

const linesOf = (text: string) => text.split("\n").length;
/** Every element with a prefix. */
const prefixed = (text: string, prefix: string) =>
  but(text.replace(/<(\/?)(\w)/g, `<$1${prefix}:$2`), " xmlns=", ` xmlns:${prefix}=`);
const doctype = (inner: string, text = dae) => but(text, "?>\n", `?>\n<!DOCTYPE COLLADA${inner}>\n`);

it("a file without prefixes and DOCTYPE stays what it is", () => {
  expect(plainDae("a.dae", dae)).toBe(dae);
});

describe("elements with a prefix", () => {
  it("that is bound to COLLADA are read as without it", async () => {
    expect(await glbOf(prefixed(dae, "c"))).toEqual(wanted);
    expect(await glbOf(prefixed(dae, "collada.1_4"))).toEqual(wanted);
    expect(linesOf(plainDae("a.dae", prefixed(dae, "c")))).toBe(linesOf(dae));
    const version = but(prefixed(dae, "c"), address, "http://www.collada.org/2008/03/COLLADASchema");
    expect(await glbOf(version)).toEqual(wanted);
  });

  it("are read where only some of them have it, which the reader of three.js would leave out", async () => {
    const mesh = but(but(dae, "<mesh>", `<c:mesh xmlns:c="${address}">`), "</mesh>", "</c:mesh>");
    expect(await glbOf(mesh)).toEqual(wanted);
    const faces = but(mesh, "<triangles", "<c:triangles").replace("</triangles>", "</c:triangles>");
    expect(await glbOf(faces)).toEqual(wanted);
    const empty = but(but(mesh, "<triangles", "<c:extra/><triangles"), /<input([^>]*"VERTEX"[^>]*)\/>/, "<c:input$1/>");
    expect(await glbOf(empty)).toEqual(wanted);
  });

  it("that is bound to something else are left out with all that is in them", async () => {
    const other = `<x:triangles xmlns:x="urn:x" count="many"><x:p>a</x:p>\n<triangles count="7"/></x:triangles>`;
    expect(await glbOf(but(dae, "<triangles", `${other}<triangles`))).toEqual(wanted);
    expect(await glbOf(but(dae, "<triangles", '<xml:extra/><x:extra xmlns:x="urn:x"/><triangles'))).toEqual(wanted);
    const again = `<c:extra xmlns:c="urn:x"><c:a/></c:extra>`; // within, the prefix is another's
    expect(await glbOf(but(prefixed(dae, "c"), "<c:triangles", `${again}<c:triangles`))).toEqual(wanted);
  });

  it("that nothing declares are refused by their line", async () => {
    const undeclared = "a.dae, line 17: <y:triangles> has the prefix “y”, which nothing declares.";
    const own = but(dae, "<triangles", "<y:triangles").replace("</triangles>", "</y:triangles>");
    expect(await refusalOf(own)).toBe(undeclared);
    expect(await refusalOf(but(own, "<COLLADA ", '<COLLADA xmlns:y="" '))).toBe(undeclared);
    expect(await refusalOf(but(own, "<asset>", `<y:extra xmlns:y="${address}"/><asset>`))).toBe(undeclared);
    const inner = but(dae, "<triangles", '<x:a xmlns:x="urn:x"><y:b/></x:a><triangles');
    expect(await refusalOf(inner)).toBe("a.dae, line 17: <y:b> has the prefix “y”, which nothing declares.");
  });

  it("are refused by their line as others are, and by the prefix if the file begins with another's", async () => {
    const wrong = but(prefixed(dae, "c"), "<c:p>0 1 13", "<c:p>0 1 999");
    expect(await refusalOf(wrong)).toContain(
      "a.dae, line 18: <triangles> of the geometry “tube” has a polygon 0 with vertex 999;",
    );
    const begin = "a.dae, line 2: the file begins with <c:COLLADA> and the prefix “c”, which ";
    expect(await refusalOf(but(prefixed(dae, "c"), / xmlns:c="[^"]*"/, ""))).toBe(
      `${begin}nothing declares, and not to COLLADA.`,
    );
    expect(await refusalOf(but(prefixed(dae, "c"), address, "urn:x"))).toBe(`${begin}is bound to “urn:x”, and not to COLLADA.`);
    expect(await refusalOf(but(prefixed(dae, "c"), "</c:mesh>", "</mesh>"))).toContain(
      ", line 19: </mesh> ends <c:mesh> of line 11.",
    );
  });
});

describe("a DOCTYPE", () => {
  it.each([
    "",
    ' SYSTEM "collada.dtd"',
    ' PUBLIC "-//X//a > b//EN" \'http://dtd.example/"c".dtd\'',
    " [ <!ELEMENT asset (unit)> ]",
    ' SYSTEM "a.dtd" [\n<!-- ]> <!ENTITY a "b"> \' -->\n<?a <!ENTITY?>\n<!ELEMENT a ANY>\n<!NOTATION n SYSTEM "]>"> ] ',
  ])("that declares no entities is passed over, and what it names is not loaded: <!DOCTYPE COLLADA%s>", async (inner) => {
    const text = doctype(inner);
    expect(await glbOf(text)).toEqual(wanted);
    expect(await glbOf(`<!-- <a> -->${but(text, /^.*\n/, "")}`)).toEqual(wanted);
    const at = linesOf(text) - linesOf(dae);
    const wrong = await refusalOf(but(text, "<p>0 1 13", "<p>0 x 13"));
    expect(wrong).toBe(`a.dae, line ${18 + at}: <p> has “x”, which is no whole number from 0.`);
  });

  it("that declares entities or attributes is refused by that line", async () => {
    const levels = Array.from({ length: 12 }, (_, k) => `<!ENTITY a${k + 1} "${`&a${k};`.repeat(10)}">`).join("\n");
    const bomb = doctype(` [\n<!ENTITY a0 "1">\n${levels}\n]`);
    const entity = "the DOCTYPE declares an entity (<!ENTITY), which this page does not read.";
    expect(await refusalOf(but(bomb, "<p>0", "<p>&a12;"))).toBe(`a.dae, line 3: ${entity}`);
    expect(await refusalOf(doctype('\n[<!ELEMENT a ANY>\n\n<!ENTITY % b SYSTEM "file:///etc/passwd"> %b;]'))).toBe(
      `a.dae, line 5: ${entity}`,
    );
    expect(await refusalOf(doctype(' [<!ATTLIST accessor stride CDATA "3">]'))).toBe(
      "a.dae, line 2: the DOCTYPE declares attributes (<!ATTLIST), which this page does not read.",
    );
  });

  it("in another place or in small letters is refused by its line", async () => {
    const second = but(doctype(""), "<COLLADA", '<!-- a -->\n<!DOCTYPE COLLADA [<!ENTITY a "1">]>\n<COLLADA');
    expect(await refusalOf(second)).toBe("a.dae, line 4: this is a second DOCTYPE, and a file has one at most.");
    const late = "a DOCTYPE can stand before the first element only.";
    expect(await refusalOf(but(dae, "<asset>", "<!DOCTYPE a><asset>"))).toBe(`a.dae, line 3: ${late}`);
    expect(await refusalOf(but(doctype(""), "<asset>", '<!DOCTYPE a [<!ENTITY a "1">]><asset>'))).toBe(
      `a.dae, line 4: ${late}`,
    );
    expect(await refusalOf(`${dae}\n<!DOCTYPE a>`)).toBe(`a.dae, line ${linesOf(dae) + 1}: ${late}`);
    expect(await refusalOf(but(doctype(""), "<!DOCTYPE", "<!doctype"))).toBe(
      "a.dae, line 2: <!doctype must be in capitals: <!DOCTYPE.",
    );
    expect(await refusalOf(but(dae, "<asset>", "<!ELEMENT a ANY><asset>"))).toBe("a.dae, line 3: <!ELEMENT cannot stand here.");
    expect(await glbOf(but(dae, "<asset>", "<!-- <!DOCTYPE a> --><asset>"))).toEqual(wanted);
  });

  it("without an end is refused by its line, however long it is", async () => {
    expect(await refusalOf(but(dae, "?>\n", "?>\n<!DOCTYPE a [ "))).toContain(
      "a.dae ends too soon: the DOCTYPE of line 2 has no end.",
    );
    expect(await refusalOf(but(dae, "?>\n", "?>\n<!DOCTYPE a [\n<!-- "))).toBe("a.dae, line 3: <!-- has no --> after it.");
    expect(await refusalOf(`<!DOCTYPE a ${"[<".repeat(500_000)}`)).toBe(
      "a.dae ends too soon: the DOCTYPE of line 1 has no end.",
    );
  });
});

it("nodes may lie in each other up to a limit, and are refused by their line beyond", async () => {
  const nested = (count: number) =>
    but(but(dae, "<node ", `${"<node>\n".repeat(count)}<node `), "</node>", "</node>".repeat(count + 1));
  expect((await glbOf(nested(490))).length).toBeGreaterThan(wanted.length);
  const line = dae.split("\n").findIndex((one) => one.includes("<node ")) + 1 + 497; // three elements lie above
  expect(await refusalOf(nested(5000))).toBe(
    `a.dae, line ${line}: <node> lies in 500 other elements; this page reads no deeper.`,
  );
});
