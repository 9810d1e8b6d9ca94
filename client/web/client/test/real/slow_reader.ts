// Reads a session's frames, does nothing at all for a while, and goes on: node slow_reader.ts URL SESSION CREDIT PAUSE_MS.
// Writes a line of JSON for each frame taken, and one when it pauses and when it resumes.
import { joinSession } from "lpdeform-client";

const [url, name, credit, pauseMs] = process.argv.slice(2) as [string, string, string, string];
const say = (line: object) => process.stdout.write(`${JSON.stringify(line)}\n`);

let receivedBytes = 0;
/** As fetch, but counts what comes. */
async function counting(...request: Parameters<typeof fetch>): Promise<Response> {
  const response = await fetch(...request);
  const count = new TransformStream<Uint8Array, Uint8Array>({
    transform(chunk, controller) {
      receivedBytes += chunk.byteLength;
      controller.enqueue(chunk);
    },
  });
  return new Response(response.body!.pipeThrough(count), response);
}

const session = await joinSession(name, { url, credit: Number(credit), fetch: counting });
let taken = 0;
for await (const { inputSeq, wireBytes } of session) {
  say({ inputSeq, wireBytes, receivedBytes, at: Date.now() });
  if (++taken === 20) {
    say({ pauses: Date.now(), receivedBytes });
    Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, Number(pauseMs));
    say({ resumes: Date.now(), receivedBytes });
  }
  if (taken === 40) break;
}
await session.close();
