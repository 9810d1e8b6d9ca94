/** A rectangle with sides along the axes, y downwards. */
export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

export function overlap(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

const nothing: Box = { left: 0, top: 0, right: 0, bottom: 0 };

/** The best part of a box that a few others leave free, each of which takes away all beyond one of its sides; empty if there is none. */
export function freeRoom(box: Box, covers: readonly Box[], worth: (part: Box) => number): Box {
  const first = covers.findIndex((cover) => overlap(box, cover));
  if (first < 0) return box;
  const { left, top, right, bottom } = covers[first]!;
  const others = covers.slice(first + 1);
  const parts: Box[] = [
    { ...box, left: right },
    { ...box, right: left },
    { ...box, top: bottom },
    { ...box, bottom: top },
  ];
  return parts
    .filter(({ left, top, right, bottom }) => left < right && top < bottom)
    .map((part) => freeRoom(part, others, worth))
    .reduce((best, part) => (worth(part) > worth(best) ? part : best), nothing);
}
