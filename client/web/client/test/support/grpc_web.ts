import { fromBinary } from "@bufbuild/protobuf";
import { FrameAssembly } from "../../src/assembly.js";
import { SolveResponseSchema } from "../../src/gen/lpdeform/v1/service_pb.js";

/** The numbers in the body of a Solve call's answer, as they came over the wire. */
export function resultIn(body: Buffer, vertexCount: number): { positions: Float64Array; distortion: Float64Array } {
  const assembly = new FrameAssembly(vertexCount, true);
  const isTrailer = 0x80;
  for (let at = 0, length = 0; at < body.length; at += 5 + length) {
    length = body.readUInt32BE(at + 1);
    if (body[at]! & isTrailer) continue;
    const { message } = fromBinary(SolveResponseSchema, new Uint8Array(body.subarray(at + 5, at + 5 + length)));
    const frame = message.case === "frame" && assembly.add(message.value);
    if (frame) return frame.raw as ReturnType<typeof resultIn>;
  }
  throw new Error("the answer has no result");
}
