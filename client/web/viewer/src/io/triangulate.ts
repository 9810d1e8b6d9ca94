import { ShapeUtils, Vector2 } from "three";

/**
 * The triangles of a polygon in space: three corners each, counted through all rings, and turned as the outline is. `points`: x, y, z
 * of each corner. `rings`: how many corners the outline has, and after it each hole. Each corner has a triangle. Undefined if
 * a hole does not lie within the outline, or crosses it or another hole. An outline that crosses itself becomes a fan.
 */
export function triangulated(points: readonly number[], rings: readonly number[]): number[] | undefined {
  const hasHoles = rings.length > 1;
  if (!hasHoles && rings[0] === 3) return [0, 1, 2];
  if (!hasHoles && rings[0] === 4 && isParted(points)) return usual;
  const flat = flattened(points, rings[0]!);
  if (!hasHoles && rings[0] === 4) return quad(flat);
  const found = flat && clipped(flat, rings);
  return found ?? (hasHoles ? undefined : fan(rings[0]!));
}

/** In the plane of the outline, seen from where it turns counter-clockwise; undefined if it has no area. */
function flattened(points: readonly number[], count: number): Vector2[] | undefined {
  const at = (k: number): [number, number, number] => [
    points[3 * k]! - points[0]!,
    points[3 * k + 1]! - points[1]!,
    points[3 * k + 2]! - points[2]!,
  ];
  const normal = [0, 0, 0];
  for (let k = 0; k < count; ++k) {
    const [a, b] = [at(k), at((k + 1) % count)];
    normal.forEach((_, axis) => {
      const [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
      normal[axis]! += a[i]! * b[j]! - a[j]! * b[i]!;
    });
  }
  const size = Math.hypot(...normal);
  if (!(size > 0 && Number.isFinite(size))) return undefined;
  const [x, y, z] = normal.map((value) => value / size) as [number, number, number];
  // Any two axes at right angles to the normal and to each other.
  const sign = z < 0 ? -1 : 1;
  const a = -1 / (sign + z);
  const right = [1 + sign * x * x * a, sign * x * y * a, -sign * x] as const;
  const up = [x * y * a, sign + y * y * a, -y] as const;
  const along = (axis: readonly [number, number, number], place: readonly number[]) =>
    axis[0] * place[0]! + axis[1] * place[1]! + axis[2] * place[2]!;
  return Array.from({ length: points.length / 3 }, (_, k) => new Vector2(along(right, at(k)), along(up, at(k))));
}

/** Twice the area of a triangle; above 0 if it turns counter-clockwise. */
const turn = (a: Vector2, b: Vector2, c: Vector2) => (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);

const fan = (count: number) => Array.from({ length: count - 2 }, (_, k) => [0, k + 1, k + 2]).flat();

/** Four corners, parted along the diagonal between 1 and 3. */
const usual = [0, 1, 3, 1, 2, 3];

/** Whether the two triangles of the usual diagonal turn alike. Most quads end here: files may have a million of them. */
function isParted(points: readonly number[]): boolean {
  const along = (from: number, to: number, axis: number) => points[3 * to + axis]! - points[3 * from + axis]!;
  let sum = 0;
  for (let axis = 0; axis < 3; ++axis) {
    const [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
    const first = along(0, 1, i) * along(0, 3, j) - along(0, 1, j) * along(0, 3, i);
    const second = along(1, 2, i) * along(1, 3, j) - along(1, 2, j) * along(1, 3, i);
    sum += first * second;
  }
  return sum > 0;
}

/** Parted along the usual diagonal, unless the other one alone lies inside. */
function quad(flat: readonly Vector2[] | undefined): number[] {
  const other = [0, 1, 2, 0, 2, 3];
  const isInside = (way: readonly number[]) =>
    [0, 3].every((k) => turn(flat![way[k]!]!, flat![way[k + 1]!]!, flat![way[k + 2]!]!) > 0);
  return flat && !isInside(usual) && isInside(other) ? other : usual;
}

const tolerance = 1e-6;

/** Undefined if the triangles do not cover the outline without the holes. */
function clipped(flat: readonly Vector2[], rings: readonly number[]): number[] | undefined {
  const kept: number[] = []; // the corner of each point that the library keeps: it leaves out the last of a ring if it is the first again
  const contours: Vector2[][] = [];
  let begin = 0;
  for (const size of rings) {
    contours.push(flat.slice(begin, begin + size));
    begin += size;
  }
  const areas = contours.map((contour) => Math.abs(ShapeUtils.area(contour)));
  const found = ShapeUtils.triangulateShape(contours[0]!, contours.slice(1));
  begin = 0;
  rings.forEach((size, ring) => {
    for (let k = 0; k < contours[ring]!.length; ++k) kept.push(begin + k);
    begin += size;
  });
  let covered = 0;
  const triangles = found.flatMap((corners) => {
    const [a, b, c] = corners.map((corner) => kept[corner]!) as [number, number, number];
    const twice = turn(flat[a]!, flat[b]!, flat[c]!);
    covered += Math.abs(twice) / 2;
    return twice < 0 ? [a, c, b] : [a, b, c];
  });
  const wanted = areas.reduce((rest, hole) => rest - hole);
  if (triangles.length === 0 || !(Math.abs(covered - wanted) <= tolerance * areas[0]!)) return undefined;
  insertMissing(triangles, rings);
  return triangles;
}

/** Corners on a straight border may be left out: the triangle at that border is parted there. */
function insertMissing(triangles: number[], rings: readonly number[]): void {
  const count = rings.reduce((sum, size) => sum + size);
  const isUsed = new Uint8Array(count);
  for (const corner of triangles) isUsed[corner] = 1;
  if (isUsed.every((used) => used === 1)) return;
  const edges = new Map<number, number>(); // the triangle at an edge
  const note = (at: number) =>
    [0, 1, 2].forEach((k) => edges.set(triangles[at + k]! * count + triangles[at + ((k + 1) % 3)]!, at));
  for (let at = 0; at < triangles.length; at += 3) note(at);
  let begin = 0;
  for (const size of rings) {
    const at = (k: number) => begin + ((first + k) % size);
    const first = isUsed.subarray(begin, begin + size).indexOf(1);
    let [before, next] = [at(0), 0];
    for (let k = 1; first >= 0 && k < size; ++k) {
      const corner = at(k);
      next = Math.max(next, k + 1);
      while (!isUsed[at(next)]) ++next;
      if (!isUsed[corner]) part(before, corner, at(next));
      if (isUsed[corner]) before = corner;
    }
    begin += size;
  }

  function part(before: number, corner: number, after: number): void {
    const at = edges.get(before * count + after) ?? edges.get(after * count + before);
    if (at === undefined) return;
    const own = triangles.slice(at, at + 3);
    const k = own.findIndex((one, n) => [before, after].includes(one) && [before, after].includes(own[(n + 1) % 3]!));
    const [a, b, c] = [own[k]!, own[(k + 1) % 3]!, own[(k + 2) % 3]!];
    [triangles[at], triangles[at + 1], triangles[at + 2]] = [a, corner, c];
    triangles.push(corner, b, c);
    isUsed[corner] = 1;
    note(at);
    note(triangles.length - 3);
  }
}
