import { expect, test } from "vitest";
import { Lane, type LaneSink } from "../src/hub.js";

test("the call that acknowledges a frame begins after the session has received the frame", async () => {
  const order: string[] = [];
  let acknowledged = () => {};
  const isAcknowledged = new Promise<void>((resolve) => (acknowledged = resolve));
  const calls = {
    client: { streamSessions: () => expect.fail("no stream is opened") },
    longestSilenceMs: 0,
    call: async () => {
      order.push("acknowledged");
      acknowledged();
    },
  };
  const nothing = () => {};
  const sink = { opened: nothing } as Partial<LaneSink> as LaneSink;
  const lane = new Lane(calls, "sessions/1", {}, sink, nothing, nothing);
  lane.opened({ streamId: "stream1.0" } as Parameters<Lane["opened"]>[0]);
  lane.acknowledge(1, "stream1.0");
  void (async () => {
    for (let step = 0; step < 100; ++step) await undefined; // more than any chain of promises that leads to a caller
    order.push("taken");
  })();
  await isAcknowledged;
  expect(order).toEqual(["taken", "acknowledged"]);
});
