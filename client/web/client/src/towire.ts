import { create, type MessageInitShape } from "@bufbuild/protobuf";
import {
  FieldSchema,
  type Field,
  MeshSchema,
  type Mesh as WireMesh,
  Scalar,
  WeldSchema,
  type Weld as WireWeld,
} from "./gen/lpdeform/v1/data_pb.js";
import { Encoding, type FrameOptionsSchema } from "./gen/lpdeform/v1/frame_pb.js";
import {
  HandleSchema,
  type HandleUpdateSchema,
  InitialGuess,
  Method,
  type MotionSchema,
  type SettingsUpdateSchema,
} from "./gen/lpdeform/v1/handle_pb.js";
import { WeightKind } from "./gen/lpdeform/v1/report_pb.js";
import { FreeComponents, UpdateSchema, type Update as WireUpdate } from "./gen/lpdeform/v1/service_pb.js";
import { holdToWire, vector } from "./hold_kinds.js";
import { bytesOfIndices, bytesOfNumbers, type Packer } from "./packer.js";
import { rigidOf } from "./rotation.js";
import { joined } from "./task.js";
import type * as api from "./types.js";

// From the values of this library to messages of the contract.

export const methods: Record<api.Method, Method> = {
  auto: Method.UNSPECIFIED,
  quasiNewton: Method.QUASI_NEWTON,
  lineSearch: Method.LINE_SEARCH,
  localGlobal: Method.LOCAL_GLOBAL,
  conic: Method.CONIC,
  multiresolution: Method.MULTIRESOLUTION,
};

const guesses: Record<api.InitialGuess, InitialGuess> = {
  current: InitialGuess.UNSPECIFIED,
  laplacian: InitialGuess.LAPLACIAN,
  rest: InitialGuess.REST,
};

export const weights: Record<api.WeightKind, WeightKind> = {
  cotangent: WeightKind.COTANGENT,
  uniform: WeightKind.UNIFORM,
  intrinsicDelaunay: WeightKind.INTRINSIC_DELAUNAY,
};

export const freeComponents: Record<api.FreeComponents, FreeComponents> = {
  error: FreeComponents.ERROR,
  stay: FreeComponents.STAY,
  follow: FreeComponents.FOLLOW,
};

const encodings: Record<api.Encoding, Encoding> = {
  float32: Encoding.RAW,
  float64: Encoding.RAW,
  quantized: Encoding.QUANTIZED,
  compressed: Encoding.COMPRESSED,
};

export function frameOptionsToWire(options: api.FrameOptions): MessageInitShape<typeof FrameOptionsSchema> {
  const {
    credit = 0,
    withoutDistortion = false,
    withNormals = false,
    certify = false,
    maxFramesPerSecond = 0,
  } = options;
  const { encoding = "float32", lowestEncoding = "quantized" } = options;
  return {
    credit,
    withoutDistortion,
    withNormals,
    certify,
    maxFramesPerSecond,
    encoding: encodings[encoding],
    lowestEncoding: encodings[lowestEncoding],
    ...(encoding === "float64" && { scalar: Scalar.FLOAT64 }),
  };
}

export async function meshToWire(mesh: api.Mesh, packer: Packer): Promise<WireMesh> {
  const { scalar, bytes } = bytesOfNumbers(mesh.vertices);
  const faces = bytesOfIndices(mesh.faces);
  return create(MeshSchema, {
    vertexCount: mesh.vertices.length / 3,
    faceCount: mesh.faces.length / 3,
    scalar,
    data: packer.pack(await joined(bytes, faces)),
  });
}

export function weldToWire(weld: api.Weld, packer: Packer): WireWeld {
  if (weld === "byPosition") return create(WeldSchema, { by: { case: "position", value: {} } });
  if ("length" in weld) return create(WeldSchema, { by: { case: "groups", value: packer.indices(weld) } });
  return create(WeldSchema, { by: { case: "position", value: { tolerance: weld.tolerance ?? 0 } } });
}

export function updateToWire(update: api.Update, inputSeq: number, packer: Packer): WireUpdate {
  return create(UpdateSchema, {
    inputSeq: BigInt(inputSeq),
    handles: Object.entries(update.handles ?? {}).map(([name, change]) => changeToWire(name, change, packer)),
    ...(update.settings && { settings: settingsToWire(update.settings, packer) }),
    ...(update.resize && { resize: resizeToWire(update.resize) }),
    ...(update.beginsStep && { beginsStep: true }),
  });
}

export function settingsToWire(settings: api.Settings, packer: Packer): MessageInitShape<typeof SettingsUpdateSchema> {
  const { p, stiffness, lengthUnit, solver, region } = settings;
  return {
    ...(p !== undefined && { p: fieldToWire(p, packer) }),
    ...(stiffness !== undefined && { stiffness: fieldToWire(stiffness, packer) }),
    ...(lengthUnit !== undefined && { lengthUnit: { length: lengthUnit } }),
    ...(solver && {
      solver: {
        method: methods[solver.method ?? "auto"],
        tolerance: solver.tolerance ?? 0,
        maxIterations: solver.maxIterations ?? 0,
        timeLimitSeconds: solver.timeLimitSeconds ?? 0,
        initial: guesses[solver.initial ?? "current"],
        ...(solver.search && { search: searchToWire(solver.search) }),
      },
    }),
    ...(region && { region: region.length > 0 ? { vertices: packer.indices(region) } : {} }),
  };
}

function searchToWire({ effort, show = false, leastShare = 0 }: api.MinimaSearch) {
  return { ...(effort !== undefined && { effort }), show, leastShare };
}

function fieldToWire(value: api.FieldValue, packer: Packer): Field {
  if (typeof value === "number") return create(FieldSchema, { value: { case: "uniform", value } });
  if ("automatic" in value) {
    return create(FieldSchema, { value: { case: "automatic", value: { strength: value.automatic } } });
  }
  const { scalar, buffer } = packer.numbers(value);
  return create(FieldSchema, { value: { case: "perVertex", value: { scalar, values: buffer } } });
}

function changeToWire(
  name: string,
  change: api.HandleChange,
  packer: Packer,
): MessageInitShape<typeof HandleUpdateSchema> {
  if ("set" in change) return { name, change: { case: "set", value: handleToWire(change.set, packer) } };
  if ("move" in change) return { name, change: { case: "move", value: motionToWire(change.move, packer) } };
  return { name, change: { case: "remove", value: {} } };
}

function handleToWire(handle: api.Handle, packer: Packer): MessageInitShape<typeof HandleSchema> {
  const points = handle.points ?? [];
  const vertices = handle.vertices ?? [];
  return {
    ...((vertices.length > 0 || points.length === 0) && { vertices: packer.indices(vertices) }),
    ...(points.length > 0 && { points: pointsToWire(points, packer) }),
    motion: motionToWire(handle.motion ?? "fixed", packer),
    hold: holdToWire(handle.hold ?? { kind: "exact" }),
    footprintRadius: handle.footprint ?? 0,
  };
}

function pointsToWire(points: readonly api.SurfacePoint[], packer: Packer) {
  const faces = packer.indices(points.map((point) => point.face));
  const { scalar, buffer } = packer.numbers(points.flatMap((point) => [...point.barycentric]));
  return { faces, scalar, barycentric: buffer };
}

function motionToWire(motion: api.Motion, packer: Packer): MessageInitShape<typeof MotionSchema> {
  if (motion === "fixed") return { kind: { case: "fixed", value: {} } };
  if ("targets" in motion) {
    const { scalar, buffer } = packer.numbers(motion.targets);
    return { kind: { case: "targets", value: { scalar, positions: buffer } } };
  }
  const { axis = [0, 0, 1], angle = 0, center = [0, 0, 0], translation = [0, 0, 0] } = rigidOf(motion);
  return {
    kind: {
      case: "rigid",
      value: { axis: vector(axis), angleRadians: angle, center: vector(center), translation: vector(translation) },
    },
  };
}

function resizeToWire(resize: api.Resize) {
  return {
    scale: vector(resize.scale),
    ...(resize.origin && { origin: vector(resize.origin) }),
    ...(resize.axes && { xAxis: vector(resize.axes[0]), yAxis: vector(resize.axes[1]) }),
  };
}
