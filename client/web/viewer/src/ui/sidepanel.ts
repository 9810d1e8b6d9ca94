import type { App } from "../app/app.js";
import { blendPanel } from "./blend.js";
import { el } from "./dom.js";
import { handlesPanel } from "./handles.js";
import { lookPanel } from "./look.js";
import { measures } from "./measures.js";
import { posesPanel } from "./poses.js";
import { searchPanel } from "./search.js";
import { reportPanel, warningsOf } from "./report.js";

export function sidePanel(app: App): HTMLElement {
  const mesh = section("Mesh", reportPanel(app), false);
  const numbers = section("Measures", measures(app), true);
  numbers.classList.add("numbers-section");
  const element = el(
    "aside",
    { className: "panel", aria: { label: "Side panel" } },
    section("Handles", handlesPanel(app), true),
    section("Blend through p", blendPanel(app), true),
    section("Poses", posesPanel(app), false),
    section("Look", lookPanel(app), true),
    section("Lower minima", searchPanel(app), false),
    numbers,
    mesh,
  );
  app.facts.watch(
    ({ report }) => [report],
    ([report]) => {
      const { seamVertices, looseVertices } = app.facts.now;
      const isSplit = report !== undefined && ((seamVertices > 0 && !app.view.now.isWelded) || looseVertices > 0);
      const count = warningsOf(report).length + (isSplit ? 1 : 0);
      mesh.classList.toggle("warned", count > 0);
      if (count > 0) mesh.open = true;
      if (mesh.contains(document.activeElement)) return; // moving it would take the focus away
      if (count > 0) element.prepend(mesh);
      else element.append(mesh);
    },
  );
  app.view.watchAll(({ isPanelOpen }) => document.body.classList.toggle("panel-closed", !isPanelOpen));
  return element;
}

function section(title: string, content: HTMLElement, isOpen: boolean): HTMLDetailsElement {
  return el("details", { open: isOpen }, el("summary", {}, title), content);
}
