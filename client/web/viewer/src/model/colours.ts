export type Rgb = readonly [number, number, number];

/** Blue, cyan, green, yellow, red, each 0 to 255, as in the command line's pictures. */
export const stops: readonly Rgb[] = [
  [38, 70, 200],
  [60, 180, 230],
  [90, 195, 95],
  [250, 220, 60],
  [215, 40, 35],
];

/** Distinct for most eyes, on light and on dark; groups use them in turn. */
export const groupColours: readonly string[] = [
  "#ff7a1a",
  "#2f8cff",
  "#e0409c",
  "#12b886",
  "#9b5de5",
  "#f2b705",
  "#00b8d9",
  "#e5484d",
  "#7cb518",
  "#8d6e63",
];
