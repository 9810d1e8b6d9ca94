import type { Lease } from "./lease.js";
import type { NumberedUpdate } from "./ledger.js";
import { Packer } from "./packer.js";
import type { Rpc } from "./rpc.js";
import { updateToWire } from "./towire.js";
import { Uploads } from "./upload.js";

/** Whether the update survives the end of the server. What it has of large arrays is uploaded first. */
export async function sendUpdate(
  rpc: Rpc,
  { session, writerToken }: Lease,
  update: NumberedUpdate,
  signal: AbortSignal,
): Promise<boolean> {
  const packer = new Packer();
  const uploads = new Uploads(rpc, signal);
  const message = updateToWire(update.update, update.seq, packer);
  try {
    await packer.flush((bytes) => uploads.add(bytes));
    const { result } = await rpc.call("updateHandles", { session, writerToken, update: message }, signal);
    return result?.kept ?? false;
  } finally {
    uploads.discard();
  }
}
