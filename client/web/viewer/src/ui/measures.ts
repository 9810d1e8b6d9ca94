import type { App } from "../app/app.js";
import type { Pane } from "../app/pane.js";
import { blueToRed } from "../model/colours.js";
import { histogram } from "../model/statistics.js";
import { el, setText, short } from "./dom.js";
import { plotBars, plotLines } from "./plot.js";

const binCount = 48;
/** Plots are for eyes: some a second do. */
const plotEveryMs = 120;

const rows = [
  ["fps", "Frames a second"],
  ["latency", "Input to picture, p50 · p99"],
  ["service", "…without drawing"],
  ["bytes", "Received"],
  ["vertices", "Vertices · faces"],
  ["energy", "Energy"],
  ["share", "Distortion in the top 5 %"],
  ["method", "Method · iterations"],
  ["stop", "Stop reason"],
  ["gap", "Gap to the optimum, at most"],
] as const;

type Row = (typeof rows)[number][0];

/** Plots and numbers of what the panes show. */
export function measures(app: App): HTMLElement {
  const energy = el("canvas", { className: "plot" });
  const bars = el("canvas", { className: "plot" });
  const values = {} as Record<Row, HTMLElement>;
  const list = el("dl", { className: "numbers" });
  for (const [row, text] of rows) {
    values[row] = el("dd", { data: { measure: row } });
    list.append(el("dt", {}, text), values[row]);
  }
  const element = el(
    "div",
    { className: "measures" },
    el("figure", {}, el("figcaption", {}, "Energy by iteration"), energy),
    el("figure", {}, el("figcaption", {}, "Cells by energy"), bars),
    list,
  );
  let last = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const show = () => {
    timer = undefined;
    last = performance.now();
    if (element.offsetParent === null) return;
    showNumbers(app, values, last);
    showPlots(app, energy, bars);
    if (app.panes.some(({ live }) => live && live.meter.framesPerSecond(last) > 0)) timer = setTimeout(show, 500);
  };
  const soon = () => {
    const wait = last + plotEveryMs - performance.now();
    if (wait <= 0) {
      clearTimeout(timer);
      show();
    } else {
      timer ??= setTimeout(show, wait);
    }
  };
  app.afterDrawing.add(soon);
  app.view.watch(soon);
  return element;
}

function showNumbers(app: App, values: Record<Row, HTMLElement>, now: number): void {
  const both = (text: (pane: Pane) => string) => [...new Set(app.panes.map(text))].join("  |  ");
  const sum = (number: (pane: Pane) => number) => app.panes.reduce((total, pane) => total + number(pane), 0);
  const milliseconds = (value: number) => (Number.isNaN(value) ? "–" : `${value.toFixed(0)}`);
  const { mesh, report } = app.facts.now;
  setText(values.fps, both(({ live }) => String(live?.meter.framesPerSecond(now) ?? 0)));
  setText(values.latency, both(({ live }) => `${milliseconds(live?.meter.latency(0.5) ?? NaN)} · ${milliseconds(live?.meter.latency(0.99) ?? NaN)} ms`));
  setText(values.service, both(({ live }) => `${milliseconds(live?.meter.service(0.5) ?? NaN)} · ${milliseconds(live?.meter.service(0.99) ?? NaN)} ms`));
  setText(values.bytes, `${short(sum(({ live }) => live?.meter.bytesPerSecond(now) ?? 0) / 1e6)} MB/s, ${app.view.now.encoding}`);
  setText(values.vertices, `${(mesh.positions.length / 3).toLocaleString("en")} · ${((report?.faces ?? mesh.faces.length / 3)).toLocaleString("en")}`);
  setText(values.energy, both(({ frame }) => (frame ? short(frame.energy) : "–")));
  setText(values.share, both(({ statistics }) => (app.red > 0 ? `${(100 * statistics.top5Share).toFixed(0)} %` : "–")));
  setText(values.method, both(({ frame }) => (frame?.method ? `${frame.method.replaceAll("_", " ")} · ${frame.iteration}` : "–")));
  setText(values.stop, both(({ frame }) => (frame ? frame.stopReason.replaceAll("_", " ") : "–")));
  setText(values.gap, both(({ result }) => (result?.optimalityGap === undefined ? "–" : `${short(100 * result.optimalityGap)} %`)));
}

const second = "#ff7a1a";

function showPlots(app: App, energy: HTMLCanvasElement, bars: HTMLCanvasElement): void {
  const lines = app.panes.map(({ trail }, k) => ({ x: trail.iterations, y: trail.energies, ...(k > 0 && { colour: second }) }));
  plotLines(energy, lines, app.panes[0]!.trail.starts, short);
  const { red } = app;
  const most = red > 0 ? Math.max(...app.panes.map(({ statistics }) => statistics.max)) : 0;
  const counts = new Float64Array(binCount);
  if (most > 0) for (const pane of app.panes) histogram(pane.distortion, most, binCount).forEach((count, k) => (counts[k]! += count));
  plotBars(bars, counts, (share) => `rgb(${blueToRed(red > 0 ? (share * most) / red : 0).join(",")})`, short(most));
}
