export type Numbers = Float32Array | Float64Array;

type Vector = readonly [number, number, number];

/**
 * Turns directions at vertices as the surface turns there. A direction keeps its coordinates in the frame of the vertex's
 * normal and of the direction to a neighbour. So a rigid motion turns it like the surface.
 */
export class NormalTurner {
  readonly #normals: readonly [Float64Array, Float64Array];
  readonly #neighbours: Int32Array;

  constructor(
    readonly rest: Numbers,
    readonly deformed: Numbers,
    faces: Uint32Array,
  ) {
    this.#normals = [normalsOf(rest, faces), normalsOf(deformed, faces)];
    this.#neighbours = new Int32Array(rest.length / 3).fill(-1);
    faces.forEach((vertex, corner) => (this.#neighbours[vertex] = faces[corner % 3 === 2 ? corner - 2 : corner + 1]!));
  }

  /** Unchanged if the surface has no frame there. */
  turned(vertex: number, direction: readonly number[]): readonly number[] {
    const from = this.#frame(this.rest, this.#normals[0], vertex);
    const to = this.#frame(this.deformed, this.#normals[1], vertex);
    if (!from || !to) return direction;
    const parts = from.map((axis) => dot(axis, direction));
    return [0, 1, 2].map((k) => parts[0]! * to[0]![k]! + parts[1]! * to[1]![k]! + parts[2]! * to[2]![k]!);
  }

  #frame(positions: Numbers, normals: Float64Array, vertex: number): Vector[] | undefined {
    const neighbour = this.#neighbours[vertex] ?? -1;
    if (neighbour < 0) return undefined;
    const normal = unit(at(normals, vertex));
    const [from, to] = [at(positions, vertex), at(positions, neighbour)];
    const way: Vector = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    if (!normal) return undefined;
    const up = dot(normal, way);
    const across = unit([way[0] - up * normal[0], way[1] - up * normal[1], way[2] - up * normal[2]]);
    return across && [normal, across, cross(normal, across)];
  }
}

function normalsOf(positions: Numbers, faces: Uint32Array): Float64Array {
  const normals = new Float64Array(positions.length);
  for (let f = 0; f < faces.length; f += 3) {
    const corners = faces.subarray(f, f + 3);
    const [a, b, c] = [at(positions, corners[0]!), at(positions, corners[1]!), at(positions, corners[2]!)];
    const normal = cross([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    for (const vertex of corners) for (let axis = 0; axis < 3; ++axis) normals[3 * vertex + axis]! += normal[axis]!;
  }
  return normals;
}

function at(numbers: Numbers, vertex: number): Vector {
  return [numbers[3 * vertex]!, numbers[3 * vertex + 1]!, numbers[3 * vertex + 2]!];
}

function dot(a: readonly number[], b: readonly number[]): number {
  return a[0]! * b[0]! + a[1]! * b[1]! + a[2]! * b[2]!;
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function unit(vector: Vector): Vector | undefined {
  const length = Math.hypot(...vector);
  return length > 0 ? [vector[0] / length, vector[1] / length, vector[2] / length] : undefined;
}
