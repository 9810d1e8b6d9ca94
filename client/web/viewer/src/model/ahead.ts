import { isAlike } from "./alike.js";
import type { Document, Handle } from "./document.js";
import type { Pose } from "./pose.js";

/** What has moved since a frame: handles that are held exactly, by one motion, and the vertices of all others. */
export interface Ahead {
  /** Of the handles that moved. The same array for the same handles. */
  pulled: readonly number[];
  held: readonly number[];
  /** Of one of them in the frame, and now. */
  from: Pose;
  to: Pose;
}

/** How the handles of `now` are ahead of those of `before`; undefined if none is, or if more than poses has changed. */
export function aheadOf(before: Document, now: Document): Ahead | undefined {
  if (before.handles === now.handles || before.handles.length !== now.handles.length) return undefined;
  const moved: Handle[] = [];
  for (const [k, handle] of now.handles.entries()) {
    const old = before.handles[k]!;
    if (old === handle) continue;
    if (old.vertices !== handle.vertices || old.points || handle.points || handle.targets || old.targets) return undefined;
    if (handle.hold.kind !== "exact") continue;
    if (!isAlike(old.pose, handle.pose)) moved.push(handle);
  }
  const [first] = moved;
  if (!first || moved.length > 1) return undefined;
  const others = now.handles.filter((handle) => handle !== first);
  const { pose } = before.handles[now.handles.indexOf(first)]!;
  return { pulled: first.vertices, held: others.flatMap(({ vertices }) => vertices), from: pose, to: first.pose };
}
