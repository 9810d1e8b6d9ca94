import { FrameAssembly } from "./assembly.js";
import { fromCall, LpdeformError, serverSilent } from "./errors.js";
import { methodName, stopReasonFromWire } from "./fromwire.js";
import { Scalar } from "./gen/lpdeform/v1/data_pb.js";
import type { SolveResponse } from "./gen/lpdeform/v1/service_pb.js";
import type { Lease } from "./lease.js";
import type { NumberedUpdate } from "./ledger.js";
import { tell } from "./listeners.js";
import { Packer } from "./packer.js";
import type { Rpc } from "./rpc.js";
import { updateToWire } from "./towire.js";
import type { WireFrame } from "./frame.js";
import type { DoubleSolveOptions, IterationRecord, SolveOptions, SolveResult } from "./types.js";
import { Uploads } from "./upload.js";

/**
 * One Solve call, from its request to the finished result. `end`: its deadline, on the clock of performance.now(). The call
 * counts as dead after three heartbeats of silence. `onSolved`: called once the server has solved, before the result has come.
 */
export async function runSolve(
  rpc: Rpc,
  lease: Lease,
  update: NumberedUpdate | undefined,
  options: SolveOptions | DoubleSolveOptions,
  end: number | undefined,
  signal: AbortSignal,
  onSolved: () => void,
): Promise<SolveResult<Float32Array | Float64Array>> {
  const uploads = new Uploads(rpc, signal);
  const packer = new Packer();
  const dead = new AbortController();
  let silence: ReturnType<typeof setTimeout> | undefined;
  const heard = () => {
    clearTimeout(silence);
    silence = setTimeout(() => dead.abort(serverSilent()), rpc.longestSilenceMs);
  };
  const initial = options.initialPositions && packer.numbers(options.initialPositions);
  const request = {
    session: lease.session,
    scalar: isDouble(options) ? Scalar.FLOAT64 : Scalar.FLOAT32,
    writerToken: lease.writerToken,
    certify: options.certify ?? false,
    trace: options.trace ?? false,
    progress: options.onProgress !== undefined,
    normals: options.withNormals ?? false,
    ...(update && { update: updateToWire(update.update, update.seq, packer) }),
    ...(initial && { initialPositions: { scalar: initial.scalar, data: initial.buffer } }),
  };
  try {
    await packer.flush((bytes) => uploads.add(bytes));
    const calling = {
      signal: AbortSignal.any([signal, dead.signal]),
      timeoutMs: end === undefined ? 0 : Math.max(Math.ceil(end - performance.now()), 1),
    };
    const result = new ResultBuilder(lease.report.vertices, options, onSolved);
    heard();
    for await (const response of rpc.client.solve(request, calling)) {
      heard();
      result.take(response);
    }
    return result.finish();
  } catch (thrown) {
    throw dead.signal.aborted ? dead.signal.reason : fromCall(thrown);
  } finally {
    clearTimeout(silence);
    uploads.discard();
  }
}

function isDouble(options: SolveOptions | DoubleSolveOptions): boolean {
  return "scalar" in options && options.scalar === "float64";
}

class ResultBuilder {
  readonly #assembly: FrameAssembly;
  readonly #trace: IterationRecord[] = [];
  #numbers: Omit<SolveResult, "positions" | "distortion" | "normals" | "trace"> | undefined;
  #surface: WireFrame["raw"] | undefined;

  constructor(
    vertexCount: number,
    readonly options: SolveOptions | DoubleSolveOptions,
    readonly onSolved: () => void,
  ) {
    this.#assembly = new FrameAssembly(vertexCount, isDouble(options));
  }

  take({ message }: SolveResponse): void {
    switch (message.case) {
      case "progress": {
        const { iteration, energy, seconds } = message.value;
        const { onProgress } = this.options;
        if (onProgress) tell(onProgress, { iteration, energy, seconds });
        break;
      }
      case "summary": {
        const { $typeName: _, $unknown: __, method, stopReason, certificate, inputSeq, ...numbers } = message.value;
        this.#numbers = {
          ...numbers,
          method: methodName(method),
          stopReason: stopReasonFromWire(stopReason),
          inputSeq: Number(inputSeq),
          ...(certificate && { optimalityGap: certificate.relativeGap }),
        };
        this.onSolved();
        break;
      }
      case "trace":
        for (const { iteration, seconds, energy, objective, stage } of message.value.records) {
          this.#trace.push({ iteration, seconds, energy, objective, stage });
        }
        break;
      case "frame":
        this.#surface = this.#assembly.add(message.value)?.raw ?? this.#surface;
        break;
    }
  }

  finish(): SolveResult<Float32Array | Float64Array> {
    if (!this.#numbers || !this.#surface) {
      throw new LpdeformError("data_loss", "The server's result came without positions.", { reason: "FRAME_PARTS" });
    }
    const { positions, distortion, normals } = this.#surface;
    return { ...this.#numbers, positions, distortion, normals, trace: this.#trace };
  }
}
