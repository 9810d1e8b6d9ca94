import "../src/io/worker_dom.js";
import { expect, it } from "vitest";

it("elements of a name are sought once, also if elements change while they are gone through", () => {
  const xml = new DOMParser().parseFromString("<a><b/><c><b/></c></a>", "application/xml");
  const root = xml.documentElement;
  for (const from of [xml, root]) {
    const all = from.getElementsByTagName("b");
    const count = all.length;
    expect(count).toBeGreaterThanOrEqual(2);
    root.appendChild(xml.createElement("b"));
    expect(all.length).toBe(count);
    expect(from.getElementsByTagName("b").length).toBe(count + 1);
  }
});
