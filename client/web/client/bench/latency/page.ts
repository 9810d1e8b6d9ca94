// The page of `npm run latency`: it drags where it is told to, and shows nothing.
import { drag } from "./drag.js";

declare global {
  interface Window {
    drag?: typeof drag;
  }
}

window.drag = drag;
