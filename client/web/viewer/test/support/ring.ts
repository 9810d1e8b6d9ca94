/** A closed ring about the z axis as an OBJ file: `around` times `across` vertices. */
export function ringObj(around: number, across: number): string {
  const lines: string[] = [];
  for (let i = 0; i < around; ++i) {
    for (let k = 0; k < across; ++k) {
      const [turn, roll] = [(2 * Math.PI * i) / around, (2 * Math.PI * k) / across];
      const thickness = 0.35 + 0.03 * Math.sin(9 * turn) * Math.cos(4 * roll);
      const far = 1 + thickness * Math.cos(roll);
      const place = [far * Math.cos(turn), far * Math.sin(turn), thickness * Math.sin(roll)];
      lines.push(`v ${place.map((value) => value.toFixed(5)).join(" ")}`);
    }
  }
  const at = (i: number, k: number) => (i % around) * across + (k % across) + 1;
  for (let i = 0; i < around; ++i) {
    for (let k = 0; k < across; ++k) {
      lines.push(`f ${at(i, k)} ${at(i + 1, k)} ${at(i + 1, k + 1)}`, `f ${at(i, k)} ${at(i + 1, k + 1)} ${at(i, k + 1)}`);
    }
  }
  return `${lines.join("\n")}\n`;
}

/** The vertex of ringObj() nearest to these shares of a turn around the axis and around the ring's middle. */
export function ringVertex(around: number, across: number, turn: number, roll: number): number {
  return (Math.round(turn * around) % around) * across + (Math.round(roll * across) % across);
}
