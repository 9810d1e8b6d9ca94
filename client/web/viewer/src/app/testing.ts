import { project } from "../model/selection.js";
import { viewProjection } from "../stage/pointing.js";
import type { App } from "./app.js";

/** What scripted users ask of the page: `window.__lpdeform`. Reads only. */
export function exposeForTests(app: App): void {
  const paneAt = (pane: number) => app.panes[pane]!;
  const inspect = {
    app,
    positions: (pane = 0) => [...(paneAt(pane).frame?.positions ?? [])],
    distortion: (pane = 0) => [...(paneAt(pane).frame?.distortion ?? [])],
    frame: (pane = 0) => {
      const { frame, result, live } = paneAt(pane);
      if (!frame) return undefined;
      const { inputSeq, converged, energy, stopReason, epoch, iteration } = frame;
      return { inputSeq, converged, energy, stopReason, epoch, iteration, isSettling: live!.isSettling, gap: result?.optimalityGap };
    },
    document: () => app.document,
    status: () => app.facts.now.status.kind,
    meter: (pane = 0) => {
      const { meter } = paneAt(pane).live!;
      const now = performance.now();
      return {
        inputs: meter.inputs,
        p50: meter.latency(0.5),
        p99: meter.latency(0.99),
        service50: meter.service(0.5),
        service99: meter.service(0.99),
        framesPerSecond: meter.framesPerSecond(now),
        bytesPerSecond: meter.bytesPerSecond(now),
      };
    },
    /** On the page, in CSS pixels. */
    vertexOnPage: (vertex: number, pane = 0) => {
      const { stage } = paneAt(pane);
      const screen = project(stage.surface!.positions, viewProjection(stage), stage.width, stage.height);
      const box = stage.canvas.getBoundingClientRect();
      return { x: box.left + screen[2 * vertex]!, y: box.top + screen[2 * vertex + 1]! };
    },
  };
  Object.assign(window, { __lpdeform: inspect });
}
