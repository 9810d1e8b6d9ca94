/** Three digits, for reading at a glance: "1.2 k", "0.031". */
export function short(value: number): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e6) return `${(value / 1e6).toPrecision(3)} M`;
  if (size >= 1e4) return `${(value / 1e3).toPrecision(3)} k`;
  if (size < 1e-3)
    return value
      .toExponential(1)
      .replace("e-", "·10⁻")
      .replace(/\d+$/, (digits) => [...digits].map((d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(d)]).join(""));
  return Number(value.toPrecision(3)).toString();
}

/** "7 %", "0.3 %", rounded down. */
export function percent(share: number): string {
  const value = Math.min(Math.max(100 * share, 0), 99);
  const step = value >= 1 || value === 0 ? 1 : 10 ** Math.floor(Math.log10(value));
  return `${short(step * Math.floor(value / step + 1e-9))}\u00a0%`;
}

/**
 * What is known of minima that are lower than a result. Frames do not say whether the server has searched. `saved`: the share of
 * energy that the better shape saves, if one is known.
 */
export function lowerText(saved: number | undefined): string {
  return saved === undefined ? "may exist" : `known, ${percent(saved)} less energy`;
}

/** The first five of the names, each cut to a length that a line can hold, and how many more there are. */
export function someOf(names: readonly string[]): string {
  const [few, longest] = [5, 80];
  const shown = names.slice(0, few).map((name) => (name.length > longest ? `${name.slice(0, longest)}…` : name));
  const more = names.length > few ? ` and ${(names.length - few).toLocaleString("en")} more` : "";
  return `${shown.join(", ")}${more}`;
}

export function capital(text: string): string {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}
