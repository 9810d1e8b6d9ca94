/** How many neighbouring faces a block has, the last block fewer. */
const blockFaces = 64;
const cells = 1024;

/** Faces in an order in which neighbours are near each other: along a Morton curve through the middles of the faces. */
export function faceOrder(positions: Float32Array, faces: Uint32Array): Uint32Array {
  const count = faces.length / 3;
  const middle = (face: number, axis: number) => {
    const [a, b, c] = [faces[3 * face]!, faces[3 * face + 1]!, faces[3 * face + 2]!];
    return positions[3 * a + axis]! + positions[3 * b + axis]! + positions[3 * c + axis]!;
  };
  const codes = new Float64Array(count);
  for (let axis = 0; axis < 3; ++axis) {
    let [low, high] = [Infinity, -Infinity];
    for (let face = 0; face < count; ++face) {
      low = Math.min(low, middle(face, axis));
      high = Math.max(high, middle(face, axis));
    }
    const scale = high > low ? (cells - 1) / (high - low) : 0;
    for (let face = 0; face < count; ++face) codes[face]! += spaced((middle(face, axis) - low) * scale) * 2 ** axis;
  }
  // Code and face in one number, which sorts much faster than with a comparison.
  for (let face = 0; face < count; ++face) codes[face] = codes[face]! * 2 ** 23 + face;
  codes.sort();
  return Uint32Array.from(codes, (code) => code % 2 ** 23);
}

/** The ten lowest bits with two zeros between each. */
function spaced(value: number): number {
  let bits = value & 0x3ff;
  bits = (bits | (bits << 16)) & 0x030000ff;
  bits = (bits | (bits << 8)) & 0x0300f00f;
  bits = (bits | (bits << 4)) & 0x030c30c3;
  return (bits | (bits << 2)) & 0x09249249;
}

/** For each block of faces in this order the least x, y, z of its corners, and the largest. */
export function blockBoxes(positions: Float32Array, faces: Uint32Array, order: Uint32Array): Float32Array {
  const boxes = new Float32Array(6 * Math.ceil(order.length / blockFaces));
  for (let begin = 0, at = 0; begin < order.length; begin += blockFaces, at += 6) {
    const end = Math.min(begin + blockFaces, order.length);
    boxes.fill(Infinity, at, at + 3).fill(-Infinity, at + 3, at + 6);
    for (let k = begin; k < end; ++k) {
      for (let corner = 3 * order[k]!; corner < 3 * order[k]! + 3; ++corner) {
        const vertex = 3 * faces[corner]!;
        for (let axis = 0; axis < 3; ++axis) {
          const value = positions[vertex + axis]!;
          if (value < boxes[at + axis]!) boxes[at + axis] = value;
          if (value > boxes[at + 3 + axis]!) boxes[at + 3 + axis] = value;
        }
      }
    }
  }
  return boxes;
}

/** Blocks of faces and their boxes for the present positions. */
export interface FaceBlocks {
  order: Uint32Array;
  boxes: Float32Array;
}

/** Visits the faces whose block the ray enters nearer than `reach()`. */
export function visitFaces(
  { order, boxes }: FaceBlocks,
  origin: readonly number[],
  direction: readonly number[],
  reach: () => number,
  visit: (face: number) => void,
): void {
  for (let block = 0; 6 * block < boxes.length; ++block) {
    let [enter, leave] = [0, reach()];
    for (let axis = 0; axis < 3; ++axis) {
      const inverse = 1 / direction[axis]!;
      const a = (boxes[6 * block + axis]! - origin[axis]!) * inverse;
      const b = (boxes[6 * block + 3 + axis]! - origin[axis]!) * inverse;
      // NaN, of a ray within the plane of a side, changes nothing.
      if (Math.min(a, b) > enter) enter = Math.min(a, b);
      if (Math.max(a, b) < leave) leave = Math.max(a, b);
    }
    // Flat boxes and rounding: a little more is tested than is entered.
    if (enter > leave * (1 + 1e-6)) continue;
    const end = Math.min((block + 1) * blockFaces, order.length);
    for (let k = block * blockFaces; k < end; ++k) visit(order[k]!);
  }
}
