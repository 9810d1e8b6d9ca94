import { describe, expect, test } from "vitest";
import { Ledger, merged, type NumberedUpdate } from "../src/ledger.js";

const at = (x: number) => ({ translation: [x, 0, 0] as const });

describe("merging", () => {
  test("the newest motion of a handle wins, and moves one that was added before", () => {
    const added = {
      handles: { tip: { set: { vertices: [1], hold: { kind: "exact" as const } } }, base: { move: at(1) } },
    };
    expect(merged(added, { handles: { tip: { move: at(2) }, base: { move: at(3) } } }).handles).toEqual({
      tip: { set: { vertices: [1], hold: { kind: "exact" }, motion: at(2) } },
      base: { move: at(3) },
    });
  });

  test("settings that are left out keep their value", () => {
    expect(merged({ settings: { p: 1, stiffness: 2 } }, { settings: { p: 3 } }).settings).toEqual({
      p: 3,
      stiffness: 2,
    });
  });

  test("a resizing replaces its handle and its fields, and a later handle of that name the resizing", () => {
    const before = {
      handles: { resize: { set: { vertices: [1] } }, tip: { move: at(1) } },
      settings: { p: 1, lengthUnit: 2 },
    };
    const resized = merged(before, { resize: { scale: [2, 1, 1] } });
    expect(resized).toEqual({
      handles: { tip: { move: at(1) } },
      settings: { lengthUnit: 2 },
      resize: { scale: [2, 1, 1] },
    });
    expect(merged(resized, { handles: { resize: { remove: true } } }).resize).toBeUndefined();
  });

  test("goes by names, whatever they are", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { ["__proto__"]: { set: { vertices: [1] } } } });
    ledger.add({ handles: { ["__proto__"]: { move: at(1) }, constructor: { move: at(2) } } });
    ledger.accept(ledger.sendNext());
    ledger.sessionLost();
    expect(Object.entries(ledger.sendNext().update.handles!)).toEqual([
      ["__proto__", { set: { vertices: [1], motion: at(1) } }],
    ]);
  });

  test("leaves what it is given as it was", () => {
    const older = { handles: { tip: { move: at(1) } }, settings: { p: 1 } };
    merged(older, { handles: { tip: { move: at(2) } }, settings: { p: 2 } });
    expect(older).toEqual({ handles: { tip: { move: at(1) } }, settings: { p: 1 } });
  });
});

/** Both on their way. */
function twoMoves(ledger: Ledger, names = ["tip", "tip"]): [NumberedUpdate, NumberedUpdate] {
  const [first, second] = names.map((name, k) => {
    ledger.add({ handles: { [name]: { move: at(k + 1) } } });
    return ledger.sendNext();
  });
  return [first!, second!];
}

describe("ledger", () => {
  test("merges what waits and numbers it by the newest", () => {
    const ledger = new Ledger();
    expect(ledger.add({ handles: { tip: { set: { vertices: [1] } } } })).toBe(1);
    expect(ledger.add({ handles: { tip: { move: at(1) } } })).toBe(2);
    expect(ledger.sendNext()).toEqual({
      seq: 2,
      update: { handles: { tip: { set: { vertices: [1], motion: at(1) } } }, settings: {} },
    });
    expect(ledger.canSend).toBe(false);
  });

  test("has several on their way only where all merely move handles", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
    const added = ledger.sendNext();
    ledger.add({ handles: { tip: { move: at(1) } } });
    expect(ledger.canSend).toBe(false);
    ledger.accept(added);
    const moved = ledger.sendNext();
    ledger.add({ handles: { tip: { move: at(2) } } });
    expect(ledger.canSend).toBe(true);
    const movedOn = ledger.sendNext();
    ledger.add({ handles: { tip: { move: at(3) } } });
    expect(ledger.canSend).toBe(false);
    ledger.accept(moved);
    ledger.accept(movedOn);
    ledger.add({ settings: { p: 2 } });
    expect(ledger.canSend).toBe(true);
  });

  test("keeps the newest motion however answers overtake each other", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
    ledger.accept(ledger.sendNext());
    const [first, second] = twoMoves(ledger);
    ledger.accept(second);
    ledger.accept(first);
    ledger.sessionLost();
    expect(ledger.sendNext().update.handles).toEqual({ tip: { set: { vertices: [1], motion: at(2) } } });
  });

  test("counts an answer that overtook one that is refused", () => {
    const ledger = new Ledger();
    const [first, second] = twoMoves(ledger);
    ledger.accept(second);
    ledger.refuse(first);
    expect(ledger.hasInFlight).toBe(false);
    expect(ledger.newest).toBe(2);
  });

  test("sends again what was on its way, under what waits", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { tip: { move: at(1) }, base: { move: at(1) } } });
    ledger.sendNext();
    ledger.add({ handles: { tip: { move: at(2) } } });
    ledger.connectionLost();
    expect(ledger.sendNext()).toEqual({
      seq: 2,
      update: { handles: { tip: { move: at(2) }, base: { move: at(1) } }, settings: {} },
    });
  });

  test("goes by what is sent again, whatever becomes late of what was on its way when the connection was lost", () => {
    const ledger = new Ledger();
    const [first, second] = twoMoves(ledger, ["tip", "base"]);
    ledger.connectionLost();
    const again = ledger.sendNext();
    expect(again).toEqual({
      seq: 2,
      update: { handles: { tip: { move: at(1) }, base: { move: at(2) } }, settings: {} },
    });
    ledger.accept(second);
    ledger.refuse(first);
    expect([first, second, again].map((sent) => ledger.isInFlight(sent))).toEqual([false, false, true]);
    ledger.connectionLost();
    expect(ledger.sendNext()).toEqual(again);
  });

  test("does not take a restored session for restored by an answer of one before", () => {
    const ledger = new Ledger();
    ledger.add({ settings: { p: 1.5 } });
    ledger.accept(ledger.sendNext());
    ledger.sessionLost();
    const first = ledger.sendNext();
    ledger.sessionLost();
    ledger.sendNext();
    ledger.accept(first);
    expect(ledger.hasInFlight).toBe(true);
  });

  test("restores what was accepted on its own, without what was removed", () => {
    const ledger = new Ledger();
    ledger.add({
      handles: { tip: { set: { vertices: [1] } }, base: { set: { vertices: [2] } } },
      settings: { p: 1.5 },
    });
    ledger.accept(ledger.sendNext());
    ledger.add({ handles: { base: { remove: true } } });
    ledger.accept(ledger.sendNext());
    ledger.add({ settings: { p: 3 } });
    ledger.sessionLost();
    expect(ledger.hasRestore).toBe(true);
    expect(ledger.sendNext()).toEqual({
      seq: 2,
      update: { handles: { tip: { set: { vertices: [1] } } }, settings: { p: 1.5 } },
    });
    expect(ledger.hasRestore).toBe(false);
    ledger.connectionLost();
    expect(ledger.hasRestore).toBe(true);
  });

  test("forgets what it refused and what another writer made void", () => {
    const ledger = new Ledger();
    ledger.add({ settings: { p: 1 } });
    ledger.refuse(ledger.sendNext());
    expect(ledger.newest).toBe(0);
    ledger.add({ settings: { p: 2 } });
    ledger.dropUnaccepted();
    expect(ledger.hasWaiting).toBe(false);
  });

  test("counts on from what the server knows", () => {
    const ledger = new Ledger();
    ledger.add({ settings: { p: 1 } });
    ledger.countFrom(40);
    expect(ledger.newest).toBe(41);
    expect(ledger.add({ settings: { p: 2 } })).toBe(42);
    ledger.countFrom(3);
    expect(ledger.add({ settings: { p: 2 } })).toBe(43);
  });

  test("sends again what was taken and not kept, where the server went back", () => {
    const ledger = new Ledger();
    const take = (update: Parameters<Ledger["add"]>[0], isKept: boolean) => {
      ledger.add(update);
      ledger.accept(ledger.sendNext(), isKept);
    };
    take({ handles: { tip: { set: { vertices: [1] } } } }, true);
    take({ handles: { old: { remove: true } } }, false);
    take({ handles: { tip: { move: at(5) } } }, false);
    ledger.resumedAt(3);
    expect(ledger.hasWaiting).toBe(false);
    ledger.resumedAt(1);
    expect(ledger.hasRestore).toBe(true);
    const sent = ledger.sendNext();
    expect(sent.seq).toBe(3);
    expect({ ...sent.update.handles }).toEqual({ old: { remove: true }, tip: { move: at(5) } });
    ledger.accept(sent, true);
    ledger.resumedAt(1);
    expect(ledger.hasWaiting).toBe(false);
  });

  test("does not send again what was not kept, once another writer took over", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
    ledger.accept(ledger.sendNext(), true);
    ledger.add({ handles: { tip: { move: at(5) } } });
    ledger.accept(ledger.sendNext(), false);
    ledger.dropUnaccepted();
    ledger.resumedAt(1);
    expect(ledger.hasWaiting).toBe(false);
  });

  describe("a stream that says, late, that the server had nothing yet", () => {
    /** An update that adds the tip was accepted; one that moves it is under way; the state is to be sent again. */
    function restoringUnderMove() {
      const ledger = new Ledger();
      ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
      ledger.accept(ledger.sendNext());
      ledger.add({ handles: { tip: { move: at(5) } } });
      const moved = ledger.sendNext();
      ledger.resumedAt(0);
      return { ledger, moved };
    }
    const there = { tip: { set: { vertices: [1], motion: at(5) } } };

    test("does not undo the move that was accepted meanwhile", () => {
      const { ledger, moved } = restoringUnderMove();
      ledger.accept(moved);
      const restore = ledger.sendNext();
      expect(restore).toMatchObject({ seq: 2, update: { handles: there } });
      ledger.accept(restore);
      ledger.sessionLost();
      expect(ledger.sendNext()).toMatchObject({ seq: 2, update: { handles: there } });
    });

    test("sends everything even if the move was stored, by a server that never had the rest", () => {
      const { ledger, moved } = restoringUnderMove();
      ledger.accept(moved, true);
      expect(ledger.sendNext()).toMatchObject({ seq: 2, update: { handles: there } });
    });

    test("keeps what waits on top of a restore whose answer never came", () => {
      const { ledger, moved } = restoringUnderMove();
      ledger.accept(moved);
      ledger.sendNext();
      ledger.add({ settings: { p: 3 } });
      ledger.connectionLost();
      expect(ledger.sendNext()).toMatchObject({ seq: 2, update: { handles: there } });
      expect(ledger.sendNext()).toMatchObject({ seq: 3, update: { handles: {}, settings: { p: 3 } } });
    });
  });

  test("has moves that were sent again under those that were sent before them and answered late", () => {
    const ledger = new Ledger();
    ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
    ledger.accept(ledger.sendNext(), true);
    ledger.add({ handles: { tip: { move: at(1) } } });
    ledger.accept(ledger.sendNext());
    ledger.add({ handles: { tip: { move: at(2) } } });
    const newer = ledger.sendNext();
    ledger.resumedAt(1);
    const restore = ledger.sendNext();
    expect(restore).toMatchObject({ seq: 2, update: { handles: { tip: { move: at(1) } } } });
    ledger.accept(newer);
    ledger.connectionLost();
    expect(ledger.sendNext()).toMatchObject({ seq: 3, update: { handles: { tip: { move: at(2) } } } });
    ledger.accept(restore);
    ledger.sessionLost();
    expect(ledger.sendNext().update.handles).toEqual({ tip: { set: { vertices: [1], motion: at(2) } } });
  });
});

describe("when a stream has been opened", () => {
  /** Two updates were accepted, the second after the stream was asked for. */
  function accepted(): [Ledger, number] {
    const ledger = new Ledger();
    ledger.beginEpoch(1);
    ledger.add({ handles: { tip: { set: { vertices: [1] } } } });
    ledger.accept(ledger.sendNext());
    const asked = ledger.newestAccepted;
    ledger.add({ handles: { tip: { move: at(1) } } });
    ledger.accept(ledger.sendNext());
    return [ledger, asked];
  }

  test("what was accepted since it was asked for is not lost, though the server did not have it then", () => {
    const [ledger, asked] = accepted();
    ledger.reopened(1, 1, asked);
    expect(ledger.hasRestore).toBe(false);
  });

  test.each([
    ["a server that has less than was accepted before", 1, 0],
    ["a server that has just got the session", 2, 2],
  ])("%s gets everything again", (_, epoch, seq) => {
    const [ledger, asked] = accepted();
    ledger.reopened(epoch, seq, asked);
    expect(ledger.sendNext()).toMatchObject({ seq: 2, update: { handles: { tip: { set: { motion: at(1) } } } } });
  });
});
