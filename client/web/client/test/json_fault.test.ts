import { expect, it } from "vitest";
import { jsonFaultAt } from "../src/mesh/json_fault.js";

const bytes = (text: string) => new TextEncoder().encode(text);
const whole = ' {"a" : [ ] , "b":{},"c":[-0.5e+3,{"d":[[1],"\\u00e9\\n\\"x"]}], "é": null,"e":true}\r\n';

const isJson = (text: string) => {
  try {
    JSON.parse(text);
    return true;
  } catch {
    return false;
  }
};

it.each([
  ['{"meshes":[}', 11],
  ['{"a":1,}', 7],
  ["[1,]", 3],
  ["[1 2]", 3],
  ["{1:2}", 1],
  ['{"a" 1}', 5],
  ['{"a":}', 5],
  ["[01]", 1],
  ["[1.]", 1],
  ["[tru]", 1],
  ["[nullx]", 1],
  ['["a\nb"]', 3],
  ['["a\\x"]', 3],
  ['["é" x]', 6], // bytes, not letters
  ["[]]", 2],
  ["}", 0],
  ["\ufeff[}", 4],
])("%j has its first fault at byte %d", (text, at) => {
  expect(jsonFaultAt(bytes(text))).toBe(at);
  expect(isJson(text)).toBe(false);
});

it("what breaks off lacks what comes after its end, and what is whole has no fault", () => {
  expect(isJson(whole)).toBe(true);
  const all = bytes(whole);
  expect(jsonFaultAt(all)).toBe(all.length);
  for (let length = 0; length < all.length; ++length) {
    const at = jsonFaultAt(all.subarray(0, length));
    // A word, a number or an escape that breaks off counts from its beginning.
    expect(at).toBeLessThanOrEqual(length);
    expect(at).toBeGreaterThan(length - 8);
  }
});

it("a wrong byte is found where it is, or where what it breaks begins", () => {
  const all = bytes(whole);
  for (let k = 0; k < all.length; ++k) {
    const wrong = all.slice();
    wrong[k] = 1;
    expect(isJson(new TextDecoder().decode(wrong))).toBe(false);
    expect(jsonFaultAt(wrong)).toBeLessThanOrEqual(k);
    expect(jsonFaultAt(wrong)).toBeGreaterThan(k - 8);
  }
});

it("lists may lie as deep as they like", () => {
  expect(jsonFaultAt(bytes("[".repeat(1_000_000)))).toBe(1_000_000);
});
