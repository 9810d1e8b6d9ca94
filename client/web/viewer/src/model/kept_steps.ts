import type { Document } from "./document.js";
import type { Steps } from "./history.js";

/** How many numbers the steps may hold beside those of the present: they are written again and again. */
const mostNumbers = 500_000;

/** The newest steps to undo, and the next to redo, as many as can be written quickly. What documents share counts once. */
export function stepsToKeep({ past, present, future }: Steps<Document>, most = mostNumbers): Steps<Document> {
  const seen = new Set<object>(arraysOf(present));
  let left = most;
  const newest = (documents: readonly Document[]) => {
    let from = documents.length;
    while (from > 0 && (left -= newNumbers(documents[from - 1]!, seen)) >= 0) --from;
    return documents.slice(from);
  };
  return { past: newest(past), present, future: newest(future) };
}

function newNumbers(document: Document, seen: Set<object>): number {
  let count = 0;
  for (const array of arraysOf(document)) {
    if (!seen.has(array)) count += array.length;
    seen.add(array);
  }
  return count;
}

function arraysOf({ handles, paintedP, stiffness, region }: Document): ArrayLike<unknown>[] {
  const ofHandles = handles.flatMap(({ vertices, points, targets }) => [vertices, points, targets]);
  return [...ofHandles, paintedP, stiffness, region].filter((array) => array !== undefined);
}
