import { type Rgb, stops } from "./colours.js";

export type PaletteName = "blueToRed" | "viridis";

interface Palette {
  label: string;
  title: string;
  /** Five colours, from the least to the most. */
  stops: readonly Rgb[];
}

export const palettes: { readonly [Name in PaletteName]: Palette } = {
  blueToRed: { label: "Blue to red", title: "As in the command line’s pictures", stops },
  viridis: {
    label: "Dark to bright",
    title: "Also for eyes that do not tell red from green: each step is brighter, the most is brightest",
    stops: [
      [68, 1, 84],
      [59, 82, 139],
      [33, 145, 140],
      [94, 201, 98],
      [253, 231, 37],
    ],
  },
};

/** The colour for t from 0 to 1; values outside are clamped. */
export function colourIn(name: PaletteName, t: number): Rgb {
  const { stops } = palettes[name];
  const scaled = Math.min(Math.max(t, 0), 1) * (stops.length - 1);
  const stop = Math.min(Math.floor(scaled), stops.length - 2);
  const [low, high] = [stops[stop]!, stops[stop + 1]!];
  return [0, 1, 2].map((k) => Math.round(low[k]! + (high[k]! - low[k]!) * (scaled - stop))) as unknown as Rgb;
}

/** For style sheets. */
export function gradientOf(name: PaletteName): string {
  return `linear-gradient(90deg, ${palettes[name].stops.map(([r, g, b]) => `rgb(${r}, ${g}, ${b})`).join(", ")})`;
}
