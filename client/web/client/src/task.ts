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
