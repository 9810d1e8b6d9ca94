import type { MessageInitShape } from "@bufbuild/protobuf";
import type { Vector3 as WireVector } from "./gen/lpdeform/v1/data_pb.js";
import type { Handle as WireHandle, HandleSchema } from "./gen/lpdeform/v1/handle_pb.js";
import { checkKeys, checkVector, checkWord } from "./key_checks.js";
import type * as api from "./types.js";

// How a handle is held: everything that this library knows of each kind beside its type in types.ts. A kind that is missing here does
// not compile.

type Kind = api.Hold["kind"];
type Check = (value: unknown, element: string) => void;

/** The server checks it. */
const unchecked: Check = () => undefined;

/** The keys of each kind, and what is checked of their values. */
const keys: { readonly [K in Kind]: { readonly [Key in keyof Extract<api.Hold, { kind: K }>]-?: Check } } = {
  exact: { kind: unchecked },
  soft: { kind: unchecked, weight: unchecked },
  orientation: { kind: unchecked, weight: unchecked },
  axisLock: { kind: unchecked, axis: checkVector },
  planeLock: { kind: unchecked, normal: checkVector },
};

export function checkHold(given: api.Hold, owner: string): void {
  checkWord(given.kind, keys, `hold of ${owner}`);
  const known: Readonly<Record<string, Check>> = keys[given.kind] ?? {};
  checkKeys(given, known, `hold of ${owner}`);
  for (const [key, check] of Object.entries(known)) {
    check((given as unknown as Readonly<Record<string, unknown>>)[key], `${key} of ${owner}`);
  }
}

export function holdToWire(hold: api.Hold): NonNullable<MessageInitShape<typeof HandleSchema>["hold"]> {
  switch (hold.kind) {
    case "exact":
      return { case: undefined };
    case "soft":
    case "orientation":
      return { case: hold.kind, value: hold.weight === undefined ? {} : { weight: hold.weight } };
    case "axisLock":
      return { case: "axisLock", value: { axis: vector(hold.axis) } };
    case "planeLock":
      return { case: "planeLock", value: { normal: vector(hold.normal) } };
  }
}

/** Exact where there is none, or one of a newer server. */
export function holdFromWire(hold: WireHandle["hold"]): api.Hold {
  switch (hold.case) {
    case undefined:
      return { kind: "exact" };
    case "soft":
    case "orientation":
      return { kind: hold.case, ...(hold.value.weight !== undefined && { weight: hold.value.weight }) };
    case "axisLock":
      return { kind: "axisLock", axis: vectorOf(hold.value.axis) };
    case "planeLock":
      return { kind: "planeLock", normal: vectorOf(hold.value.normal) };
  }
}

export function vector([x, y, z]: api.Vector3) {
  return { x, y, z };
}

export function vectorOf(vector: WireVector | undefined): api.Vector3 {
  return [vector?.x ?? 0, vector?.y ?? 0, vector?.z ?? 0];
}
