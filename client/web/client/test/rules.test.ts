import { create } from "@bufbuild/protobuf";
import { readFileSync } from "node:fs";
import { describe, expect, test } from "vitest";
import { type ErrorCode, LpdeformError } from "../src/errors.js";
import { GoAwayReason, GoAwaySchema } from "../src/gen/lpdeform/v1/service_pb.js";
import { Ledger, type NumberedUpdate } from "../src/ledger.js";
import type { Reason } from "../src/reasons.js";
import { answerOf, RecoveryRules } from "../src/recovery.js";
import type { HandleChange, RigidMotion, Update } from "../src/types.js";

// The table of what clients do after a stream, an answer or a loss: tests/golden/recovery.json, which all of them replay.

interface Said {
  code: ErrorCode | "ok";
  reason?: Reason;
  retry_after_ms?: number;
}
interface EndStep {
  ended?: Said;
  go_away?: { reason: keyof typeof GoAwayReason; reconnect_after_ms: number };
  failed_making?: Said;
  stood_ms?: number;
  away_ms?: number;
  fitted?: boolean;
  begin?: boolean;
  next: "resume" | "recreate" | "give_up";
  code: string;
  reason: string;
  pause_ms: [number, number];
}
interface LedgerStep {
  do: string;
  handles: Record<string, string>;
  seq: number;
  kept: boolean;
  epoch: number;
  input_seq: number;
  newest: number;
  count: number;
  prefix: string;
  sets?: number;
  moves?: number;
  removals?: number;
}
interface Table {
  ends: { name: string; has_copy: boolean; reconnect_for_ms: number; steps: EndStep[] }[];
  answers: { error: Said; outcome: string; is_second?: boolean }[];
  ledger: { name: string; is_bare: boolean; steps: LedgerStep[] }[];
}
const table = JSON.parse(
  readFileSync(new URL("../../../../tests/golden/recovery.json", import.meta.url), "utf8"),
) as Table;

const errorOf = (said: Said | undefined) =>
  said && said.code !== "ok"
    ? new LpdeformError(said.code, "No.", { reason: said.reason ?? "", retryAfterMs: said.retry_after_ms ?? 0 })
    : undefined;

const steps = { resume: "resume", recreate: "recreate", give_up: "giveUp" } as const;

function recoveryOf(rules: RecoveryRules, step: EndStep) {
  if (step.fitted) rules.frameFitted();
  if (step.begin) rules.begin();
  if (step.failed_making) return rules.afterFailedMaking(errorOf(step.failed_making)!);
  const said = step.go_away;
  const goAway =
    said && create(GoAwaySchema, { reason: GoAwayReason[said.reason], reconnectAfterMs: said.reconnect_after_ms });
  return rules.after({
    error: errorOf(step.ended),
    goAway,
    stoodMs: step.stood_ms ?? 0,
    awayMs: step.away_ms ?? 0,
  });
}

describe.each([0, 1])("after a stream, with chance %d", (chance) => {
  test.each(table.ends)("$name", (one) => {
    const rules = new RecoveryRules(one.has_copy, one.reconnect_for_ms, () => chance);
    for (const step of one.steps) {
      const { next, why, pauseMs } = recoveryOf(rules, step);
      expect([next, why.code, why.reason]).toEqual([steps[step.next], step.code, step.reason]);
      expect(pauseMs).toBeCloseTo(step.pause_ms[chance]!);
    }
  });
});

test.each(table.answers)("after an answer: $error.code $error.reason", ({ error, outcome, is_second }) => {
  const name = outcome === "recreate" ? "recreate" : outcome;
  expect(answerOf(errorOf(error)!, is_second)).toBe(name);
});

function changeOf(said: string): HandleChange {
  const [kind, place] = said.split(" ");
  const motion = { translation: [Number(place), 0, 0] as const };
  if (kind === "remove") return { remove: true };
  return kind === "move" ? { move: motion } : { set: { vertices: [0], motion } };
}

function saidOf(change: HandleChange): string {
  if ("remove" in change) return "remove";
  const motion = "set" in change ? change.set.motion : change.move;
  return `${"set" in change ? "set" : "move"} ${(motion as RigidMotion).translation![0]}`;
}

const mapped = <From, To>(of: Readonly<Record<string, From>> | undefined, by: (value: From) => To) =>
  Object.fromEntries(Object.entries(of ?? {}).map(([name, value]) => [name, by(value)]));

/** A ledger, and what was sent of it. */
class Replay {
  readonly ledger: Ledger;
  readonly sent: NumberedUpdate[] = [];

  constructor(isBare: boolean) {
    this.ledger = new Ledger(isBare);
    this.ledger.beginEpoch(1);
  }

  /** Each change of the update that is sent next, as the table has it. */
  send(seq: number): Record<string, string> {
    const sent = this.ledger.sendNext();
    expect(sent.seq).toBe(seq);
    this.sent.push(sent);
    return mapped((sent.update as Update).handles, saidOf);
  }

  latest(seq: number): NumberedUpdate {
    return this.sent.findLast((one) => one.seq === seq)!;
  }

  readonly steps: Record<string, (step: LedgerStep) => unknown> = {
    add: ({ handles }) => this.ledger.add({ handles: mapped(handles, changeOf) }),
    send: ({ seq, handles }) => expect(this.send(seq)).toEqual(handles),
    show: ({ epoch, seq }) => this.ledger.show(epoch ?? 1, seq),
    accept: ({ seq, kept }) => this.ledger.accept(this.latest(seq), kept),
    refuse: ({ seq }) => this.ledger.refuse(this.latest(seq)),
    connection_lost: () => this.ledger.connectionLost(),
    session_lost: () => this.ledger.sessionLost(),
    drop_unaccepted: () => this.ledger.dropUnaccepted(),
    reopened: ({ epoch, input_seq }) => this.ledger.reopened(epoch, input_seq),
    nothing_waits: () => expect(this.ledger.hasWaiting).toBe(false),
    newest: ({ newest }) => expect(this.ledger.newest).toBe(newest),
    count_from: ({ input_seq }) => this.ledger.countFrom(input_seq),
    remove_many: ({ count, prefix }) => {
      const handles = Object.fromEntries(
        Array.from({ length: count }, (_, k) => [`${prefix}${k}`, { remove: true } as const]),
      );
      this.ledger.add({ handles });
    },
    send_many: ({ seq }) => this.send(seq),
    sends: ({ seq, sets = 0, moves = 0, removals = 0 }) => {
      const kinds = Object.values(this.send(seq)).map((said) => said.split(" ")[0]);
      const count = (kind: string) => kinds.filter((one) => one === kind).length;
      expect([count("set"), count("move"), count("remove")]).toEqual([sets, moves, removals]);
    },
  };
}

test.each(table.ledger)("the book of updates: $name", ({ is_bare, steps }) => {
  const replay = new Replay(is_bare);
  for (const step of steps) replay.steps[step.do]!(step);
});
