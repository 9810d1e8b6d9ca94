import type { App } from "../app/app.js";
import type { Pane } from "../app/pane.js";
import { placeOf } from "../app/sides.js";
import { colourIn } from "../model/palettes.js";
import { histogram } from "lpdeform-client/mesh/statistics";
import { lowerText, short } from "../model/words.js";
import { el, setText } from "./dom.js";
import { plotBars, plotLines } from "./plot.js";

const binCount = 48;
/** Plots are drawn less often than numbers. */
const plotEveryMs = 200;

const rows = [
  ["fps", "Frames per second", "Pictures with a new surface"],
  ["latency", "Input to frame, ms", "From an input to the picture that shows it: median and 99th percentile"],
  ["service", "…of it service, ms", "Server and network, without drawing: median and 99th percentile"],
  ["bytes", "Received", "Bytes received over the network"],
  ["vertices", "Vertices · faces", ""],
  ["energy", "Energy", "E of Eq. 3 of the paper"],
  ["share", "In the top 5 %", "Share of the distortion in the 5 % most distorted cells"],
  ["method", "Method", "And the iterations of the newest solve"],
  ["stop", "Stop reason", "Why the solve ended"],
  ["gap", "Gap, at most", "How far the energy can be from the optimum for its rotations"],
  ["lower", "A lower minimum", "The gap does not say whether another minimum is lower"],
] as const;

type Row = (typeof rows)[number][0];

/** Plots and numbers of what the panes show. */
export function measures(app: App): HTMLElement {
  const energy = el("canvas", { className: "plot" });
  const histograms = [histogramFigure(), histogramFigure()] as const;
  const values = {} as Record<Row, HTMLElement>;
  const list = el("dl", { className: "numbers" });
  for (const [row, text, title] of rows) {
    values[row] = el("dd", { title, data: { measure: row } });
    list.append(el("dt", { title }, text), values[row]);
  }
  const element = el(
    "div",
    { className: "measures" },
    el(
      "figure",
      {},
      el(
        "figcaption",
        { title: "The p-th root of the energy: a length, which can be compared between values of p" },
        "Energy by iteration, E",
        el("sup", {}, "1/p"),
      ),
      energy,
    ),
    ...histograms.map(({ figure }) => figure),
    list,
  );
  let last = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let later: ReturnType<typeof setTimeout> | undefined;
  const show = () => {
    for (const one of [timer, later]) clearTimeout(one);
    timer = later = undefined;
    last = performance.now();
    if (element.offsetParent === null) return;
    showNumbers(app, values, last);
    showPlots(app, energy, histograms);
    if (app.panes.some(({ live }) => live && live.meter.framesPerSecond(last) > 0)) later = setTimeout(show, 500);
  };
  /** In a task of its own, so that the task of a picture is short. */
  const soon = () => {
    timer ??= setTimeout(show, last + plotEveryMs - performance.now());
  };
  app.afterDrawing.add(soon);
  app.view.watchAll(soon);
  app.facts.watch(({ better }) => [better], soon);
  return element;
}

function showNumbers(app: App, values: Record<Row, HTMLElement>, now: number): void {
  const both = (text: (pane: Pane) => string) => [...new Set(app.panes.map(text))].join(" | ");
  const sum = (number: (pane: Pane) => number) => app.panes.reduce((total, pane) => total + number(pane), 0);
  const milliseconds = (value: number) => (Number.isNaN(value) ? "–" : `${value.toFixed(0)}`);
  const { mesh, report } = app.facts.now;
  setText(
    values.fps,
    both(({ live }) => String(live?.meter.framesPerSecond(now) ?? 0)),
  );
  const pair = (shares: readonly (number | undefined)[]) => shares.map((value) => milliseconds(value ?? NaN)).join(" · ");
  setText(
    values.latency,
    both(({ live }) => pair([live?.meter.latency(0.5), live?.meter.latency(0.99)])),
  );
  setText(
    values.service,
    both(({ live }) => pair([live?.meter.service(0.5), live?.meter.service(0.99)])),
  );
  const bytes = sum(({ live }) => live?.meter.bytesPerSecond(now) ?? 0);
  setText(values.bytes, bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB/s` : `${(bytes / 1e6).toFixed(2)} MB/s`);
  setText(
    values.vertices,
    `${(mesh.positions.length / 3).toLocaleString("en")} · ${(report?.faces ?? mesh.faces.length / 3).toLocaleString("en")}`,
  );
  setText(
    values.energy,
    both(({ frame }) => (frame ? short(app.isDistorted ? frame.energy : 0) : "–")),
  );
  setText(
    values.share,
    both(({ statistics }) => (app.isDistorted ? `${(100 * statistics.top5Share).toFixed(0)} %` : "–")),
  );
  const methods = both(({ frame }) => frame?.method.replaceAll("_", " ") ?? "");
  setText(values.method, methods ? `${methods} · ${both(({ frame }) => String(frame?.iteration ?? 0))}` : "–");
  setText(
    values.stop,
    both(({ frame }) => (frame?.method ? frame.stopReason.replaceAll("_", " ") : "–")),
  );
  setText(
    values.gap,
    both(({ frame }) => (frame?.optimalityGap === undefined ? "–" : gapText(frame.optimalityGap))),
  );
  setText(
    values.lower,
    both(({ frame, live }) => (app.isDistorted && frame?.isFinal ? lowerText(live?.better?.savedShare) : "–")),
  );
}

/** The server reports 1 if it has found no bound in time. */
function gapText(gap: number): string {
  return gap < 1 ? `${short(100 * gap)} %` : "not found";
}

interface HistogramFigure {
  figure: HTMLElement;
  caption: HTMLElement;
  bars: HTMLCanvasElement;
}

/** The histogram of one pane. */
function histogramFigure(): HistogramFigure {
  const caption = el("figcaption");
  const bars = el("canvas", { className: "plot", role: "img" });
  return { figure: el("figure", {}, caption, bars), caption, bars };
}

function showPlots(app: App, energy: HTMLCanvasElement, histograms: readonly HistogramFigure[]): void {
  const { red } = app;
  const second = getComputedStyle(energy).getPropertyValue("--second");
  const lines =
    red === 0
      ? []
      : app.panes.map(({ trail, side, element }, k) => ({
          x: trail.iterations,
          y: trail.energies,
          ...(k > 0 && { colour: second }),
          ...(app.panes.length > 1 && { name: `${placeOf(side)}: ${element.dataset["label"]}` }),
        }));
  plotLines(energy, lines, app.panes[0]!.trail.starts, short);
  const most = red > 0 ? Math.max(...app.panes.map(({ statistics }) => statistics.max)) : 0;
  const colourAt = (share: number) => `rgb(${colourIn(app.view.now.palette, red > 0 ? (share * most) / red : 0).join(",")})`;
  const counts = app.panes.map(({ distortion }) =>
    most > 0 ? histogram(distortion, most, binCount) : new Float64Array(binCount),
  );
  // One scale for all panes, so that they can be compared.
  const highest = Math.max(...counts.flatMap((bins) => [...bins]));
  histograms.forEach(({ figure, caption, bars }, k) => {
    const pane = app.panes[k];
    figure.hidden = pane === undefined;
    if (!pane) return;
    setText(
      caption,
      app.panes.length > 1 ? `Cells by energy, ${placeOf(pane.side)}: ${pane.element.dataset["label"]}` : "Cells by energy",
    );
    bars.setAttribute("aria-label", `${caption.textContent}, up to ${short(pane.statistics.max)}`);
    plotBars(bars, counts[k]!, highest, colourAt, short(most));
  });
}
