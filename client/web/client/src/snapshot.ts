import { fromCall, LpdeformError } from "./errors.js";
import { type Lease, leaseOf } from "./lease.js";
import { Packer } from "./packer.js";
import type { Rpc } from "./rpc.js";
import { Uploads } from "./upload.js";
import { isUndecided } from "./verdict.js";

/** The session as a file. Rejects with DATA_LOSS if parts of it are missing. */
export async function takeSnapshot(rpc: Rpc, session: string, signal: AbortSignal): Promise<Uint8Array<ArrayBuffer>> {
  const parts: Uint8Array[] = [];
  let [has, size] = [0, 0];
  try {
    const calling = { signal, timeoutMs: rpc.callTimeoutMs };
    for await (const { offset, sizeBytes, data } of rpc.client.snapshotSession({ session }, calling)) {
      size = Number(sizeBytes);
      if (Number(offset) !== has) throw incomplete(has, size);
      parts.push(data);
      has += data.byteLength;
    }
  } catch (thrown) {
    throw fromCall(thrown);
  }
  if (has === 0 || has !== size) throw incomplete(has, size);
  const file = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    file.set(part, at);
    at += part.byteLength;
  }
  return file;
}

/**
 * Creates a session from such a file. It is idempotent: the same request id gives the same session, however often it is tried.
 */
export async function restoreSnapshot(
  rpc: Rpc,
  file: Uint8Array,
  requestId: string,
  signal?: AbortSignal,
): Promise<Lease> {
  const uploads = new Uploads(rpc, signal, requestId);
  const packer = new Packer();
  const snapshot = packer.pack(file);
  await packer.flush((bytes) => uploads.add(bytes));
  try {
    const { session, writerToken } = await rpc.call("restoreSession", { requestId, snapshot }, signal);
    uploads.discard();
    return leaseOf(session, writerToken);
  } catch (error) {
    if (!isUndecided(error as LpdeformError)) uploads.discard();
    throw error;
  }
}

function incomplete(has: number, size: number): LpdeformError {
  return new LpdeformError("data_loss", `The server sent ${has} of the snapshot's ${size} bytes.`, {
    reason: "SNAPSHOT_INCOMPLETE",
    element: "snapshot",
    limit: `${size} bytes`,
  });
}
