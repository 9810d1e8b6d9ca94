// A page of a running deploy/up, whose address is in LPDEFORM_VIEWER; tests/e2e/up_test starts both.
import { expect, it } from "vitest";
import { User } from "../real/user.js";

it("is useful in the first ten seconds: a drag, and the surface follows", async () => {
  const user = await User.open(process.env["LPDEFORM_VIEWER"]!);
  try {
    await user.settled();
    const rest = await user.positions();
    const { x, y } = await user.ask<{ x: number; y: number }>(
      "vertexOnPage(window.__lpdeform.document().handles.at(-1).vertices[40])",
    );
    await user.drag({ x, y }, -60, -60);
    await user.settled();
    const bent = await user.positions();
    expect(Math.max(...bent.map((value, k) => Math.abs(value - rest[k]!)))).toBeGreaterThan(0.05);
    expect(user.errors).toEqual([]);
  } finally {
    await user.close();
  }
});
