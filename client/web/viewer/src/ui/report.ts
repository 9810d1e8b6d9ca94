import type { Defect, MeshReport } from "lpdeform-client";
import type { App } from "../app/app.js";
import { elementsIn } from "../link/status.js";
import type { Mesh } from "lpdeform-client/mesh/mesh";
import { cornersOf, nothing, type PointedOut, within } from "../model/pointed.js";
import { el, setText, toggle } from "./dom.js";
import { short } from "../model/words.js";
import { icon } from "./icons.js";

/** The elements of a defect: the numbers in its list are vertices, faces, or pairs of vertices. */
type Element = "vertex" | "face" | "edge";
const keys = { vertex: "vertices", face: "faces", edge: "edges" } as const;

function elementOf(kind: string): Element {
  if (kind.includes("edge") || kind === "inconsistent_orientation") return "edge";
  return /face|triangle/.test(kind) ? "face" : "vertex";
}

/** Shares of the diagonal that are offered; the second is the server's own. */
const tolerances = [0, 1e-6, 1e-5, 1e-4, 1e-3];

/** Defects that the server handles by itself, and that most meshes have some of. */
const mild = new Set(["clamped_edges", "floored_vertices", "flipped_edges"]);

function defectsOf(report: MeshReport | undefined): Defect[] {
  return (report?.defects ?? []).filter(({ count }) => count > 0);
}

/** The defects that a user who cares for the mesh wants to know. */
export function warningsOf(report: MeshReport | undefined): Defect[] {
  return defectsOf(report).filter(({ kind }) => !mild.has(kind));
}

/** The mesh's report: each warning highlights its elements. */
export function reportPanel(app: App): HTMLElement {
  const summary = el("p", { className: "quiet" });
  const list = el("ul", { className: "warnings" });
  const still = el("ul", { className: "still quiet", aria: { label: "What stays as it is" } });
  const seams = el("p", { className: "quiet" });
  const weld = toggle(
    "Weld seams",
    true,
    (isOn) => void app.weld({ tolerance: app.view.now.weldTolerance, isOn }).then(showSeams),
    "Vertices in one place move as one; saved files have them all",
  );
  const reach = el("select", { aria: { label: "How far apart welded vertices may be" } });
  for (const tolerance of tolerances) {
    const text = tolerance === 0 ? "in exactly one place" : `${short(100 * tolerance)} % of the size`;
    reach.append(el("option", { value: String(tolerance), textContent: text }));
  }
  reach.title =
    "Vertices that are no farther apart count as one: up to 0.0001 % those on open borders, above that all of them; the size is the diagonal of the mesh's bounds";
  reach.addEventListener("change", () => {
    const isOn = app.view.now.isWelded;
    void app.weld({ tolerance: Number(reach.value), isOn }).then(showSeams); // also what holds if it is refused
  });
  const tolerance = el("label", { className: "pair" }, el("span", {}, "Weld within"), reach);
  const seamBox = el("div", { className: "seams", hidden: true }, seams, weld.element, tolerance);
  const showSeams = () => {
    const { seamVertices, looseVertices, report } = app.facts.now;
    const { isWelded, weldTolerance } = app.view.now;
    const hasSeams = seamVertices > 0;
    weld.input.checked = isWelded;
    reach.value = String(weldTolerance);
    seamBox.hidden = !hasSeams && !((report?.boundaryLoops ?? 0) > 0); // nothing lies open
    weld.element.hidden = !hasSeams;
    tolerance.hidden = !isWelded;
    seamBox.classList.toggle("torn", (hasSeams && !isWelded) || looseVertices > 0);
    const near = `Where ${looseVertices.toLocaleString("en")} vertices of its borders lie near others, it comes apart.`;
    const loose = looseVertices > 0 && isWelded ? ` ${near}` : "";
    if (!hasSeams) return setText(seams, `No vertices of its open borders lie on others.${loose}`);
    const copies = seamVertices === 1 ? "vertex lies on another" : "vertices lie on others";
    const fate = isWelded ? "They move as one." : "The surface tears there.";
    setText(seams, `${seamVertices.toLocaleString("en")} ${copies} along seams of textures or normals. ${fate}${loose}`);
  };
  app.facts.watch(({ seamVertices, looseVertices, report }) => [seamVertices, looseVertices, report], showSeams);
  app.view.watchAll(showSeams);
  const showReport = (report: MeshReport | undefined, { name }: Mesh) => {
    const defects = defectsOf(report);
    const parts = report && [
      `${report.vertices.toLocaleString("en")} vertices, ${report.faces.toLocaleString("en")} faces`,
      `${report.components} ${report.components === 1 ? "component" : "components"}`,
      report.boundaryLoops > 0
        ? `${report.boundaryLoops} ${report.boundaryLoops === 1 ? "hole or border" : "holes or borders"}`
        : "closed",
    ];
    summary.textContent = parts ? `${name}: ${parts.join(", ")}.` : name;
    list.replaceChildren(...defects.map((defect) => warning(app, defect)));
    const isTorn = (app.facts.now.seamVertices > 0 && !app.seams) || app.facts.now.looseVertices > 0;
    if (report && defects.length === 0 && !isTorn) list.append(el("li", { className: "good" }, "Nothing wrong with it."));
  };
  app.facts.watch(
    ({ mesh }) => [mesh],
    ([mesh]) => showStill(still, mesh),
  );
  app.facts.watch(
    ({ report, mesh }) => [report, mesh],
    ([report, mesh]) => showReport(report, mesh),
  );
  return el("div", {}, summary, list, seamBox, still);
}

/** More are counted. */
const mostStill = 50;

/** The parts of a glTF that stay as they are. */
function showStill(list: HTMLElement, { notices = [] }: Mesh): void {
  const more = notices.length - mostStill;
  const words = [...notices.slice(0, mostStill), ...(more > 0 ? [`And ${more.toLocaleString("en")} more.`] : [])];
  list.replaceChildren(...words.map((text) => el("li", {}, text)));
  list.hidden = words.length === 0;
}

/** "zero_area_faces" as "zero area face" or "faces". */
function wordsOf(kind: string, count: number): string {
  const words = kind.replace("non_", "non-").replaceAll("_", " ");
  return count === 1 ? words.replace(/ices$/, "ex").replace(/s$/, "") : words;
}

function warning(app: App, { kind, count, first }: Defect): HTMLElement {
  const text = `${count.toLocaleString("en")} ${wordsOf(kind, count)}`;
  const press = el(
    "button",
    { type: "button", title: "Show where", data: { warning: kind } },
    icon("warning"),
    el("span", {}, text),
    el("span", { className: "quiet" }, "show"),
  );
  press.addEventListener("click", () => {
    const element = elementOf(kind);
    pointOut(app, { ...nothing, [keys[element]]: first });
    const shown = element === "edge" ? first.length / 2 : first.length;
    app.notify(shown < count ? `The first ${shown} of ${text} are marked.` : `${text}: marked.`);
  });
  return el("li", { className: mild.has(kind) ? "mild" : "" }, press);
}

/** Highlights elements and turns to them; removes the previous highlight. */
export function pointOut(app: App, elements: PointedOut): void {
  const { positions, faces } = app.mesh;
  const pointedOut = within(elements, positions.length / 3, faces.length / 3);
  app.facts.set({ pointedOut });
  app.lookAt(cornersOf(pointedOut, faces));
}

export function pointOutNamed(app: App, element: string): void {
  pointOut(app, elementsIn(element, app.document.handles));
}
