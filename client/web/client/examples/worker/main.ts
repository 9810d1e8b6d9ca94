// A session in a worker: the page sends where the pointer is and draws what comes back, and neither decodes nor waits.
//
//   npx vite examples/worker       and the page http://localhost:5173/?url=http://localhost:8080
import type { FromWorker, ToWorker } from "./worker.js";

const url = new URLSearchParams(location.search).get("url") ?? "http://localhost:8080";
const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
const send = (message: ToWorker) => worker.postMessage(message);
const slider = document.querySelector("input")!;
const text = document.querySelector("output")!;
const context = document.querySelector("canvas")!.getContext("2d")!;

send({ url });
slider.oninput = () => send({ height: slider.valueAsNumber });

// The strip from the side: x to the right, z upwards.
worker.onmessage = ({ data }: MessageEvent<FromWorker>) => {
  if ("problem" in data) {
    text.value = data.problem;
    return;
  }
  const { positions, isFinal } = data;
  context.clearRect(0, 0, 600, 300);
  context.beginPath();
  for (let k = 0; k < positions.length; k += 6) context.lineTo(50 + 25 * positions[k]!, 280 - 25 * positions[k + 2]!);
  context.stroke();
  if (isFinal) text.value = `The end is at height ${positions.at(-1)!.toFixed(2)}.`;
};
