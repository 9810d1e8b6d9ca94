import { anchorOfHandle, handleOf } from "../model/document.js";
import { project } from "../model/selection.js";
import { viewProjection } from "../stage/pointing.js";
import type { App } from "./app.js";

/** What tests may read of the page: `window.__lpdeform`. Read only. */
export function exposeForTests(app: App): void {
  const paneAt = (pane: number) => app.panes[pane]!;
  /** In CSS pixels. */
  const onPage = (pane: number, point: Float32Array) => {
    app.fitIfWanted();
    const { stage } = paneAt(pane);
    const [x, y] = project(point, viewProjection(stage), stage.width, stage.height);
    const box = stage.canvas.getBoundingClientRect();
    return { x: box.left + x!, y: box.top + y! };
  };
  const inspect = {
    app,
    positions: (pane = 0) => [...(paneAt(pane).frame?.positions ?? [])],
    distortion: (pane = 0) => [...(paneAt(pane).frame?.distortion ?? [])],
    frame: (pane = 0) => {
      const { frame, live } = paneAt(pane);
      if (!frame) return undefined;
      const { inputSeq, isFinal, energy, stopReason, epoch, iteration } = frame;
      return {
        inputSeq,
        isFinal,
        energy,
        stopReason,
        epoch,
        iteration,
        isSettling: live!.isSettling,
        gap: frame.optimalityGap,
      };
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
    vertexOnPage: (vertex: number, pane = 0) =>
      onPage(pane, Float32Array.from(paneAt(pane).stage.surface!.placeOf(vertex).toArray())),
    pointOnPage: (point: readonly number[], pane = 0) => onPage(pane, Float32Array.from(point)),
    /** Where the gizmo is. */
    anchorOnPage: (pane = 0) => onPage(pane, Float32Array.from(anchorOfHandle(handleOf(app.document, app.view.now.selected)!))),
  };
  Object.assign(window, { __lpdeform: inspect });
}
