import type { Lease } from "./lease.js";
import type { NumberedUpdate } from "./ledger.js";
import { Packer } from "./packer.js";
import type { Rpc } from "./rpc.js";
import { inTaskOfItsOwn, largeVertices } from "./task.js";
import { updateToWire } from "./towire.js";
import { Uploads } from "./upload.js";

/** Sends an update, after uploading its large arrays. Resolves with whether it survives a restart of the server. */
export async function sendUpdate(
  rpc: Rpc,
  { session, writerToken, report }: Lease,
  update: NumberedUpdate,
  signal: AbortSignal,
): Promise<boolean> {
  const packer = new Packer();
  const uploads = new Uploads(rpc, signal);
  const message = updateToWire(update.update, update.seq, packer);
  try {
    if (packer.isLarge || report.vertices >= largeVertices) await new Promise<void>(inTaskOfItsOwn); // the caller's task ends first
    await packer.flush((bytes) => uploads.add(bytes));
    const { result } = await rpc.call("updateHandles", { session, writerToken, update: message }, signal);
    return result?.kept ?? false;
  } finally {
    uploads.discard();
  }
}
