import { describe, expect, it } from "vitest";
import type { Rgb } from "../src/model/colours.js";
import { addHandle, emptyDocument, paint } from "../src/model/document.js";
import { colourIn } from "../src/model/palettes.js";
import { readingOf } from "../src/model/reading.js";

const linear = (channel: number) => {
  const c = channel / 255;
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
};

/** CIE L*, 0 to 100. */
function lightness([r, g, b]: readonly number[]): number {
  const y = 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;
  return y > 0.008856 ? 116 * Math.cbrt(y) - 16 : 903.3 * y;
}

/** Linear colours as eyes see them that lack a kind of cone: Machado, Oliveira and Fernandes 2009, at full severity. */
const eyes: Record<string, readonly (readonly number[])[]> = {
  all: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  "without red cones": [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  "without green cones": [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  "without blue cones": [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
};

function seenBy(eye: string, colour: Rgb): number[] {
  const rgb = colour.map(linear);
  return eyes[eye]!.map((row) =>
    Math.min(
      Math.max(
        row.reduce((sum, value, k) => sum + value * rgb[k]!, 0),
        0,
      ),
      1,
    ),
  );
}

describe("the palette from dark to bright", () => {
  it.each(Object.keys(eyes))("is brighter at each step, and the most is by far the brightest, for eyes: %s", (eye) => {
    const steps = Array.from({ length: 11 }, (_, k) => lightness(seenBy(eye, colourIn("viridis", k / 10))));
    for (let k = 1; k < steps.length; ++k) expect(steps[k]! - steps[k - 1]!).toBeGreaterThan(3);
    expect(steps[10]! - steps[0]!).toBeGreaterThan(70);
  });

  it("is what the other palette is not", () => {
    const steps = Array.from({ length: 11 }, (_, k) => lightness(seenBy("all", colourIn("blueToRed", k / 10))));
    expect(steps[10]).toBeLessThan(steps[5]!);
  });

  it("clamps what is outside", () => {
    expect(colourIn("viridis", -1)).toEqual([68, 1, 84]);
    expect(colourIn("viridis", 2)).toEqual([253, 231, 37]);
  });
});

describe("what is read of a vertex", () => {
  const rest = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0]);
  const held = addHandle(emptyDocument, [0], rest);

  it("is its distortion and p, the slider's or the painted one", () => {
    expect(readingOf(held, 1.5, 0.03125, 2)).toBe("Vertex 2 · distortion 0.0313 · p 1.5");
    const painted = paint(held, "p", [1], 4, 3);
    expect(readingOf(painted, 1.5, 0, 1)).toBe("Vertex 1 · distortion 0 · p 4");
    expect(readingOf(painted, 1.5, 0, 2)).toBe("Vertex 2 · distortion 0 · p 1.5");
    expect(readingOf(paint(held, "stiffness", [1], 0.1, 3), 2, 0, 1)).toBe("Vertex 1 · distortion 0 · p 2 · stiffness 0.1");
  });

  it("is not more than is known", () => {
    expect(readingOf({ ...held, isAutomatic: true }, 1.5, undefined, 0)).toBe("Vertex 0 · distortion – · p from the shape");
  });
});
