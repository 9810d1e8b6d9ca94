import type { Hold } from "lpdeform-client";
import type { Vector3 } from "lpdeform-client/mesh/mesh";

/** What the page and its handle files know of a kind of hold. */
export type HoldKind<H extends Hold = Hold> = Common<H> & (None | Weight<H> | Direction<H>);

interface Common<H extends Hold> {
  /** In the list from which the user chooses. */
  readonly label: string;
  /** As the user's choice begins. */
  readonly fresh: H;
  /** Whether it holds points inside faces, too. */
  readonly takesPoints: boolean;
  /** Whether the handle is turned only, its place being free. */
  readonly isTurnedOnly: boolean;
}

// What a kind has beside its name: `fileKey` is where handle files have that, `label` what is beside it in the panel.

interface None {
  readonly fileKey?: undefined;
  readonly weight?: undefined;
  readonly direction?: undefined;
}

interface Weight<H extends Hold> {
  readonly fileKey: string;
  readonly weight: Parameter<H, number>;
  readonly direction?: undefined;
}

interface Direction<H extends Hold> {
  readonly fileKey: string;
  readonly weight?: undefined;
  readonly direction: Parameter<H, Vector3> & { readonly label: string };
}

/** A number or vector that says more of a hold: as it is in one, and the hold with it. */
interface Parameter<H extends Hold, Value> {
  of(hold: H): Value;
  with(value: Value): H;
}

const z = [0, 0, 1] as const;

/** All of them, as the user is shown them. One that is missing does not compile. */
export const holdKinds: { readonly [K in Hold["kind"]]: HoldKind<Extract<Hold, { kind: K }>> } = {
  exact: { label: "Exactly", fresh: { kind: "exact" }, takesPoints: true, isTurnedOnly: false },
  soft: {
    label: "Softly",
    fileKey: "soft",
    fresh: { kind: "soft", weight: 1 },
    takesPoints: true,
    isTurnedOnly: false,
    weight: { of: ({ weight }) => weight ?? 1, with: (weight) => ({ kind: "soft", weight }) },
  },
  orientation: {
    label: "By its direction alone",
    fileKey: "orientation",
    fresh: { kind: "orientation", weight: 100 },
    takesPoints: false,
    isTurnedOnly: true,
    weight: { of: ({ weight }) => weight ?? 100, with: (weight) => ({ kind: "orientation", weight }) },
  },
  axisLock: {
    label: "Free along an axis",
    fileKey: "axis_lock",
    fresh: { kind: "axisLock", axis: z },
    takesPoints: false,
    isTurnedOnly: false,
    direction: { label: "Along", of: ({ axis }) => axis, with: (axis) => ({ kind: "axisLock", axis }) },
  },
  planeLock: {
    label: "Free in a plane",
    fileKey: "plane_lock",
    fresh: { kind: "planeLock", normal: z },
    takesPoints: false,
    isTurnedOnly: false,
    direction: { label: "Across", of: ({ normal }) => normal, with: (normal) => ({ kind: "planeLock", normal }) },
  },
};

export function kindOf(hold: Hold): HoldKind {
  return holdKinds[hold.kind];
}
