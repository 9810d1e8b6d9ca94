/** Small plots on canvases, in the page's colours. */
interface Frame {
  context: CanvasRenderingContext2D;
  width: number;
  height: number;
  ink: string;
  faint: string;
  accent: string;
}

function begin(canvas: HTMLCanvasElement): Frame | undefined {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (width === 0 || height === 0) return undefined;
  const ratio = Math.min(devicePixelRatio, 2);
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d")!;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "11px system-ui, sans-serif";
  const style = getComputedStyle(canvas);
  const [ink, faint, accent] = ["--muted", "--line", "--accent"].map((name) => style.getPropertyValue(name)) as [
    string,
    string,
    string,
  ];
  return { context, width, height, ink, faint, accent };
}

export interface Line {
  x: readonly number[];
  y: readonly number[];
  colour?: string;
  /** A name, if there are several lines. */
  name?: string;
}

/** Lines over a common x; the y axis is logarithmic if the values need it. */
export function plotLines(
  canvas: HTMLCanvasElement,
  lines: readonly Line[],
  marks: readonly number[],
  format: (y: number) => string,
): void {
  const frame = begin(canvas);
  if (!frame) return;
  const { context, width, height, ink, faint, accent } = frame;
  const xs = lines.flatMap(({ x }) => [x[0] ?? 0, x.at(-1) ?? 0]);
  const ys = lines.flatMap(({ y }) => y).filter((y) => y > 0);
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  if (ys.length < 2 || !(right > left)) return empty(frame, "Drag a handle");
  let [low, high] = [ys.reduce((a, b) => Math.min(a, b)), ys.reduce((a, b) => Math.max(a, b))];
  // A drag begins at rest, where the value is tiny. Without that point more of the rest of the line is
  // visible.
  const tops = lines.map(({ y }) => y.reduce((a, b) => Math.max(a, b), 0)).filter((top) => top > 0);
  low = Math.max(low, 0.01 * tops.reduce((a, b) => Math.min(a, b)));
  const isLogarithmic = high / low > 20;
  const scale = isLogarithmic ? Math.log : (y: number) => y;
  if (!isLogarithmic) [low, high] = [low - 0.05 * (high - low || high), high + 0.05 * (high - low || high)];
  const toX = (x: number) => 2 + ((x - left) / (right - left)) * (width - 4);
  // Leaves room for words above and below the lines.
  const [roof, floor] = [16, height - 16];
  const toY = (y: number) => floor - ((scale(Math.max(y, low)) - scale(low)) / (scale(high) - scale(low))) * (floor - roof);
  context.strokeStyle = faint;
  context.beginPath();
  for (const mark of marks) {
    context.moveTo(toX(mark), roof - 2);
    context.lineTo(toX(mark), floor + 2);
  }
  if (marks.length < width / 4) context.stroke();
  context.lineWidth = 1.6;
  context.lineJoin = "round";
  for (const { x, y, colour } of lines) {
    context.strokeStyle = colour ?? accent;
    context.beginPath();
    y.forEach((value, k) => context.lineTo(toX(x[k]!), toY(value)));
    context.stroke();
  }
  context.lineWidth = 1;
  context.fillStyle = ink;
  context.fillText(format(high), 2, 10);
  context.fillText(isLogarithmic ? `${format(low)} (log)` : format(low), 2, height - 4);
  context.textAlign = "right";
  let at = width - 2;
  for (const { name, colour } of lines.toReversed()) {
    if (!name) continue;
    context.fillStyle = ink;
    context.fillText(name, at, 10);
    at -= context.measureText(name).width + 14;
    context.fillStyle = colour ?? accent;
    context.fillRect(at, 5, 10, 3);
    at -= 10;
  }
  context.textAlign = "left";
}

/**
 * Bars from 0 on, each in the colour of its place; the bar of `highest` has the full height. Heights are square roots, so that
 * small counts are visible beside large ones.
 */
export function plotBars(
  canvas: HTMLCanvasElement,
  counts: ArrayLike<number>,
  highest: number,
  colourAt: (share: number) => string,
  highText: string,
): void {
  const frame = begin(canvas);
  if (!frame) return;
  const { context, width, height, ink, faint } = frame;
  if (highest === 0) return empty(frame, "No distortion yet");
  const bar = width / counts.length;
  const floor = height - 13;
  for (let k = 0; k < counts.length; ++k) {
    if (counts[k] === 0) continue;
    const size = Math.max(1.5, Math.sqrt(counts[k]! / highest) * (floor - 2));
    context.fillStyle = colourAt((k + 0.5) / counts.length);
    context.fillRect(k * bar + 0.5, floor - size, Math.max(bar - 1, 1), size);
  }
  context.fillStyle = faint;
  context.fillRect(0, floor, width, 1);
  context.fillStyle = ink;
  context.fillText("0", 1, height - 2);
  context.textAlign = "right";
  context.fillText(highText, width - 1, height - 2);
  context.textAlign = "left";
}

function empty({ context, width, height, ink }: Frame, text: string): void {
  context.fillStyle = ink;
  context.textAlign = "center";
  context.fillText(text, width / 2, height / 2 + 3);
  context.textAlign = "left";
}
