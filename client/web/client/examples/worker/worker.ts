import { LpdeformError, openSession, type Session } from "lpdeform-client";

export type ToWorker = { url: string } | { height: number };
export type FromWorker = { positions: Float32Array; isFinal: boolean } | { problem: string };

const reply = (message: FromWorker, transfer: Transferable[] = []) => postMessage(message, { transfer });

// A strip of twenty squares along x.
const vertices = new Float32Array(42 * 3);
const faces: number[] = [];
for (let k = 0; k <= 20; ++k) {
  vertices.set([k, 0, 0, k, 1, 0], 6 * k);
  if (k < 20) faces.push(2 * k, 2 * k + 2, 2 * k + 1, 2 * k + 2, 2 * k + 3, 2 * k + 1);
}

let session: Session | undefined;
let height = 0;

async function open(url: string): Promise<void> {
  session = await openSession({ vertices, faces }, { url });
  session.on("problem", ({ message }) => reply({ problem: message }));
  session.setHandles({ start: { vertices: [0, 1, 2, 3] }, end: { vertices: [40, 41] } });
  session.move("end", { translation: [0, 0, height] });
  for await (const { positions, isFinal } of session) {
    const own = positions.slice(); // as a transfer takes the memory away
    reply({ positions: own, isFinal }, [own.buffer]);
  }
}

onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if ("url" in data) {
    open(data.url).catch((error: unknown) =>
      reply({ problem: error instanceof LpdeformError ? error.message : String(error) }),
    );
  } else {
    height = data.height;
    session?.move("end", { translation: [0, 0, height] });
  }
};
