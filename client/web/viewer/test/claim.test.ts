import { afterEach, describe, expect, it, vi } from "vitest";
import { claim, whileFree } from "../src/app/claim.js";

afterEach(() => vi.unstubAllGlobals());

/** As a browser's, for what is asked of them here. */
class Locks {
  readonly #held = new Set<string>();

  async request(name: string, { signal }: LockOptions, act: (lock: object | null) => unknown): Promise<unknown> {
    while (signal && this.#held.has(name)) {
      signal.throwIfAborted();
      await new Promise((again) => setTimeout(again, 5));
    }
    if (this.#held.has(name)) return act(null);
    this.#held.add(name);
    return Promise.resolve(act({})).finally(() => this.#held.delete(name));
  }
}

describe.each([
  ["by the browser's locks", true],
  ["by asking, where there are no locks", false],
])("a work, %s,", (_, hasLocks) => {
  const begin = () => {
    vi.stubGlobal("navigator", hasLocks ? { locks: new Locks() } : {});
    return crypto.randomUUID();
  };

  it("is had by one alone", async () => {
    const id = begin();
    expect(await claim(id, 0)).toBe(true);
    expect(await claim(id, 0)).toBe(false);
    expect(await claim(id, 100)).toBe(false);
    expect(await claim(crypto.randomUUID(), 0)).toBe(true);
  });

  it("is had by one alone of several that want it at once", async () => {
    const id = begin();
    const claims = await Promise.all([claim(id, 0), claim(id, 0), claim(id, 0)]);
    expect(claims.filter((isMine) => isMine).length).toBe(1);
    expect(await claim(id, 0)).toBe(false);
  });

  it("is touched by others only where nobody has it, and is free afterwards", async () => {
    const id = begin();
    const act = vi.fn(() => Promise.resolve());
    await whileFree(id, act);
    expect(act).toHaveBeenCalledTimes(1);
    expect(await claim(id, 0)).toBe(true);
    await whileFree(id, act);
    expect(act).toHaveBeenCalledTimes(1);
  });
});
