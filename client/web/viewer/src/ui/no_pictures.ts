import { el } from "./dom.js";

/** Replaces the page if the browser cannot draw. */
export function noPictures(): HTMLElement {
  return el(
    "section",
    { className: "no-pictures", role: "alert" },
    el("h1", {}, "This browser does not draw in three dimensions"),
    el(
      "p",
      {},
      "The page needs WebGL 2, which is switched off, blocked, or not there. Turn on hardware acceleration in the browser’s settings, or open the page in another browser. What you had here before is kept.",
    ),
  );
}
