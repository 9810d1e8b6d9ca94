import { crc32c } from "./crc32c.js";
import { LpdeformError } from "./errors.js";
import type { UploadPartResponse } from "./gen/lpdeform/v1/service_pb.js";
import { Backoff } from "./recovery.js";
import { newRequestId } from "./requestid.js";
import type { Rpc } from "./rpc.js";
import { pause } from "./waiting.js";

/** A page is busy for about a millisecond with sending so many. */
const mostPartBytes = 1 << 18;

/** Bytes uploaded before a call, in parts with a checksum. */
export class Uploads {
  readonly #names: string[] = [];
  #count = 0;

  /** `id`: the same for every try of a call, so that the request stays identical. */
  constructor(
    readonly rpc: Rpc,
    readonly signal?: AbortSignal,
    readonly id: string = newRequestId(),
  ) {}

  async add(bytes: Uint8Array): Promise<string> {
    const { upload, maxPartBytes } = await this.rpc.call(
      "createUpload",
      { requestId: `${this.id}-${++this.#count}`, sizeBytes: BigInt(bytes.byteLength), crc32c: await crc32c(bytes) },
      this.signal,
    );
    this.#names.push(upload);
    const partBytes = Math.min(Math.max(maxPartBytes, 1), mostPartBytes);
    let finished = false;
    for (let offset = 0; offset < bytes.byteLength; offset += partBytes) {
      const data = bytes.subarray(offset, offset + partBytes);
      ({ finished } = await this.#send({ upload, offset: BigInt(offset), data }));
    }
    if (finished) return upload;
    throw new LpdeformError("data_loss", "The server reports missing parts although all were sent.", {
      reason: "UPLOAD_INCOMPLETE",
      element: upload,
    });
  }

  /**
   * If the server has no room for a part yet, sends it again after the pause that the server asks for, within a call's time
   * limit.
   */
  async #send(part: { upload: string; offset: bigint; data: Uint8Array }): Promise<UploadPartResponse> {
    const end = performance.now() + this.rpc.callTimeoutMs;
    const backoff = new Backoff();
    for (;;) {
      try {
        return await this.rpc.call("uploadPart", part, this.signal);
      } catch (thrown) {
        const error = thrown as LpdeformError;
        const pauseMs = backoff.nextMs(error.retryAfterMs);
        const mayPass = error.code === "resource_exhausted" && error.retryAfterMs > 0;
        if (!mayPass || performance.now() + pauseMs > end) throw error;
        await pause(pauseMs, this.signal);
      }
    }
  }

  /** Frees the server's memory before the uploads expire; does not wait. */
  discard(): void {
    for (const upload of this.#names.splice(0)) this.rpc.call("deleteUpload", { upload }).catch(() => undefined);
  }
}
