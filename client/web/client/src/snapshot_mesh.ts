import { fromBinary } from "@bufbuild/protobuf";
import { BinaryReader, WireType } from "@bufbuild/protobuf/wire";
import { crc32c } from "./crc32c.js";
import { LpdeformError } from "./errors.js";
import { MeshSchema, Scalar } from "./gen/lpdeform/v1/data_pb.js";
import type { RestMesh } from "./types.js";

/** A snapshot begins with "lpdeform", its format, the checksum of its content, and how long that is; see server/keeping/snapshot.h. */
const headerBytes = 24;
const format = 1;
/** Where the mesh is in the content: the head, in it the request that made the session, and in that the mesh. */
const path = [1, 1, 2];

/** The mesh in a file of Session.snapshot(). Rejects with SNAPSHOT_NEWER and SNAPSHOT_DAMAGED. */
export async function meshIn(file: Uint8Array): Promise<RestMesh> {
  const header = new DataView(file.buffer, file.byteOffset, Math.min(file.byteLength, headerBytes));
  if (file.byteLength < headerBytes) throw damaged();
  if (header.getUint32(8, true) > format) {
    const limit = `format <= ${format}`;
    throw new LpdeformError("invalid_argument", "The server's snapshot has a later format than this client reads.", {
      reason: "SNAPSHOT_NEWER",
      element: "snapshot",
      limit,
    });
  }
  const content = file.subarray(headerBytes);
  if (content.byteLength !== Number(header.getBigUint64(16, true))) throw damaged();
  if ((await crc32c(content)) !== header.getUint32(12, true)) throw damaged();
  try {
    return arraysOf(path.reduce(fieldIn, content));
  } catch (thrown) {
    throw thrown instanceof LpdeformError ? thrown : damaged();
  }
}

/** The bytes of this field of a message. */
function fieldIn(message: Uint8Array, wanted: number): Uint8Array {
  const reader = new BinaryReader(message);
  while (reader.pos < reader.len) {
    const [number, wireType] = reader.tag();
    if (number === wanted && wireType === WireType.LengthDelimited) return reader.bytes();
    reader.skip(wireType, number);
  }
  throw damaged();
}

function arraysOf(message: Uint8Array): RestMesh {
  const { vertexCount, faceCount, scalar, data } = fromBinary(MeshSchema, message);
  const bytes = data?.source.case === "inline" ? data.source.value.slice().buffer : new ArrayBuffer(0);
  const coordinateBytes = 24 * vertexCount;
  if (scalar !== Scalar.FLOAT64 || bytes.byteLength !== coordinateBytes + 12 * faceCount) throw damaged();
  return { vertices: new Float64Array(bytes, 0, 3 * vertexCount), faces: new Uint32Array(bytes, coordinateBytes) };
}

function damaged(): LpdeformError {
  return new LpdeformError("invalid_argument", "The server's snapshot is damaged: its mesh cannot be read.", {
    reason: "SNAPSHOT_DAMAGED",
    element: "snapshot",
  });
}
