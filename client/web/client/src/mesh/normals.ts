/** The normal of the last face. */
export const normal = new Float64Array(3);

/** Of a length of twice the area. `a`, `b` and `c`: where the corners begin in the positions. */
export function findNormal(positions: Float32Array, a: number, b: number, c: number): void {
  const ax = positions[a]!;
  const ay = positions[a + 1]!;
  const az = positions[a + 2]!;
  const ux = positions[b]! - ax;
  const uy = positions[b + 1]! - ay;
  const uz = positions[b + 2]! - az;
  const vx = positions[c]! - ax;
  const vy = positions[c + 1]! - ay;
  const vz = positions[c + 2]! - az;
  normal[0] = uy * vz - uz * vy;
  normal[1] = uz * vx - ux * vz;
  normal[2] = ux * vy - uy * vx;
}

/** The sums of the faces' normals at each vertex, weighted by area; not of length 1, the shader normalises them. */
export function addNormals(positions: Float32Array, faces: Uint32Array, normals: Float32Array): void {
  normals.fill(0);
  for (let f = 0; f < faces.length; f += 3) {
    const a = 3 * faces[f]!;
    const b = 3 * faces[f + 1]!;
    const c = 3 * faces[f + 2]!;
    findNormal(positions, a, b, c);
    const x = normal[0]!;
    const y = normal[1]!;
    const z = normal[2]!;
    normals[a]! += x;
    normals[a + 1]! += y;
    normals[a + 2]! += z;
    normals[b]! += x;
    normals[b + 1]! += y;
    normals[b + 2]! += z;
    normals[c]! += x;
    normals[c + 1]! += y;
    normals[c + 2]! += z;
  }
}

/** Normals of the mesh's own vertices, for picking. */
export function vertexNormals(positions: Float32Array, faces: Uint32Array): Float32Array {
  const normals = new Float32Array(positions.length);
  addNormals(positions, faces, normals);
  return normals;
}
