const waiting: (() => void)[] = [];
let port: MessagePort | undefined;

/**
 * Runs `task` in a task of its own, after all that waits for promises that are resolved by now. Unlike a timer it is not
 * delayed in a hidden page.
 */
export function inTaskOfItsOwn(task: () => void): void {
  // In Node a port would keep the process alive.
  if (typeof setImmediate === "function") return void setImmediate(task);
  if (!port) {
    const channel = new MessageChannel();
    channel.port1.onmessage = () => waiting.shift()!();
    port = channel.port2;
  }
  waiting.push(task);
  port.postMessage(undefined);
}

/** From this number of vertices on, a page is busy for some milliseconds with a frame: unpacking it, or drawing it. */
export const largeVertices = 20_000;

/** A page is busy for about a millisecond with summing so many bytes, and less with copying them. */
export const stepBytes = 1 << 19;

/** The parts one after another. The page can do something else in between. */
export async function joined(...parts: readonly Uint8Array[]): Promise<Uint8Array> {
  const all = new Uint8Array(parts.reduce((sum, { length }) => sum + length, 0));
  let at = 0;
  for (const part of parts) {
    for (let begin = 0; begin < part.length; begin += stepBytes) {
      if (all.length > stepBytes) await new Promise<void>(inTaskOfItsOwn);
      const piece = part.subarray(begin, begin + stepBytes);
      all.set(piece, at);
      at += piece.length;
    }
  }
  return all;
}
