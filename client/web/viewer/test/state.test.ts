import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { LpdeformError } from "lpdeform-client";
import { Pulse } from "../src/link/pulse.js";
import { State } from "../src/model/state.js";

describe("a watcher", () => {
  const values = { pointer: 0, work: { p: 1, handles: "a" } };

  it("is told at once, and then of what it picks and of nothing else", () => {
    const state = new State(values);
    const told: unknown[] = [];
    state.watch(
      ({ work }) => [work.p],
      ([p], [before]) => told.push([p, before]),
    );
    for (let pointer = 1; pointer < 100; ++pointer) state.set({ pointer });
    state.set({ work: { p: 1, handles: "b" } });
    expect(told).toEqual([[1, 1]]);
    state.set({ work: { p: 2, handles: "b" } });
    expect(told.slice(1)).toEqual([[2, 1]]);
  });

  it("is told once, of the newest, where a watcher before it changes the same again", () => {
    const state = new State(values);
    const told: number[] = [];
    state.watch(
      ({ pointer }) => [pointer],
      ([pointer]) => pointer === 1 && state.set({ pointer: 2 }),
    );
    state.watch(
      ({ pointer }) => [pointer],
      ([pointer]) => told.push(pointer),
    );
    state.set({ pointer: 1 });
    expect(told).toEqual([0, 2]);
  });

  it("is told nothing any more, and let go, when its signal aborts", () => {
    const state = new State(values);
    const over = new AbortController();
    const told: number[] = [];
    state.watch(
      ({ pointer }) => [pointer],
      ([pointer]) => told.push(pointer),
      over.signal,
    );
    state.set({ pointer: 1 });
    over.abort();
    state.set({ pointer: 2 });
    expect(told).toEqual([0, 1]);
  });

  it("of everything is told of each change", () => {
    const state = new State(values);
    const told: number[][] = [];
    state.watchAll((now, before) => told.push([before.pointer, now.pointer]));
    state.set({ pointer: 1 });
    state.set({ pointer: 1 });
    expect(told).toEqual([
      [0, 0],
      [0, 1],
    ]);
  });
});

describe("the pulse", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  const after = (milliseconds: number) => vi.advanceTimersByTimeAsync(milliseconds);

  it("is silent within 1.5 seconds once the server has stopped, and not when it answers again", async () => {
    const answers: (() => void)[] = [];
    let isStopped = false;
    const told: boolean[] = [];
    const pulse: Pulse = new Pulse(
      () => (isStopped ? new Promise((resolve) => answers.push(resolve)) : Promise.resolve()),
      () => told.push(pulse.isSilent),
    );
    pulse.start();
    await after(10_000);
    expect(told).toEqual([]);
    isStopped = true;
    await after(1500);
    expect(told).toEqual([true]);
    await after(10_000);
    expect(answers).toHaveLength(1); // it does not pile up calls
    isStopped = false;
    answers[0]!();
    await after(10_000);
    expect(told).toEqual([true, false]);
    pulse.stop();
  });

  it("counts what a page is late by, up to a quarter of a second a beat: neither drawing nor a long pause delays or fakes it", async () => {
    let late = 0;
    let now = 0;
    vi.spyOn(performance, "now").mockImplementation(() => now);
    const beats = async (count: number) => {
      for (let k = 0; k < count; ++k) {
        now += 100 + late;
        await after(100);
      }
    };
    const told: boolean[] = [];
    const pulse: Pulse = new Pulse(
      () => new Promise(() => undefined),
      () => told.push(pulse.isSilent),
    );
    pulse.start();
    await beats(4); // asks
    late = 10_000;
    await beats(1); // the page itself was away
    expect(told).toEqual([]);
    late = 140;
    await beats(3);
    expect(told).toEqual([true]);
    pulse.stop();
    vi.restoreAllMocks();
  });

  it("asks nothing while something comes from the server, and is not silent as soon as something does", async () => {
    const ask = vi.fn<() => Promise<void>>(() => new Promise(() => undefined));
    const told: boolean[] = [];
    const pulse: Pulse = new Pulse(ask, () => told.push(pulse.isSilent));
    pulse.start();
    for (let k = 0; k < 50; ++k) {
      await after(100);
      pulse.heard();
    }
    expect(ask).not.toHaveBeenCalled();
    await after(1500);
    expect(told).toEqual([true]);
    pulse.heard();
    expect(told).toEqual([true, false]);
    pulse.stop();
  });

  it("takes a refusal for an answer, and asks nothing once it is stopped", async () => {
    const refusal = new LpdeformError("not_found", "no", { reason: "SESSION_UNKNOWN" });
    const ask = vi.fn<() => Promise<void>>(() => Promise.reject(refusal));
    const changed = vi.fn();
    const pulse = new Pulse(ask, changed);
    pulse.start();
    await after(3000);
    expect(ask.mock.calls.length).toBeGreaterThan(3);
    pulse.stop();
    const { length } = ask.mock.calls;
    await after(3000);
    expect(ask).toHaveBeenCalledTimes(length);
    expect(changed).not.toHaveBeenCalled();
  });

  it("stays silent while a proxy answers for a server that it does not reach", async () => {
    let isReached = false;
    const told: boolean[] = [];
    const pulse: Pulse = new Pulse(
      () => (isReached ? Promise.resolve() : Promise.reject(new LpdeformError("unavailable", "no healthy upstream"))),
      () => told.push(pulse.isSilent),
    );
    pulse.start();
    await after(3000);
    expect(told).toEqual([true]);
    isReached = true;
    await after(1000);
    expect(told).toEqual([true, false]);
    pulse.stop();
  });
});
