const prefix = "lpdeform-work-";
const channelName = "lpdeform-claims";
/** What a page that is awake needs to answer. */
const answerMs = 250;

interface Call {
  kind: "whose" | "want" | "mine";
  id: string;
  lot: number;
}

/**
 * Whether the work is nobody else's, from now on for as long as this page lives. By the browser's locks; where there are none,
 * as on pages from plain HTTP, by asking the other pages.
 */
export function claim(id: string, waitMs: number): Promise<boolean> {
  if (!navigator.locks) return claimByAsking(id, waitMs);
  return new Promise((resolve) => {
    const options = waitMs > 0 ? { signal: AbortSignal.timeout(waitMs) } : { ifAvailable: true };
    const held = navigator.locks.request(prefix + id, options, (lock) => {
      resolve(lock !== null);
      return lock === null ? undefined : new Promise(() => undefined);
    });
    held.catch(() => resolve(false));
  });
}

/** Does it with the work, which nobody else has or takes meanwhile; not at all where somebody has it. */
export async function whileFree(id: string, act: () => Promise<void>): Promise<void> {
  if (navigator.locks) await navigator.locks.request(prefix + id, { ifAvailable: true }, (lock) => lock && act());
  else if (!(await isHeld(id))) await act();
}

async function claimByAsking(id: string, waitMs: number): Promise<boolean> {
  const until = performance.now() + waitMs;
  while (!(await contend(id))) if (performance.now() >= until) return false;
  return true;
}

/** Of pages that want the same at once, the one with the smallest lot has it. Who has it goes on saying so. */
function contend(id: string): Promise<boolean> {
  const channel = new BroadcastChannel(channelName);
  const lot = Math.random();
  let isMine = false;
  return new Promise((resolve) => {
    const say = (kind: Call["kind"]) => channel.postMessage({ kind, id, lot });
    const timer = setTimeout(() => resolve((isMine = true)), answerMs);
    const giveWay = () => {
      clearTimeout(timer);
      channel.close();
      resolve(false);
    };
    channel.onmessage = ({ data }: MessageEvent<Call>) => {
      if (data.id !== id) return;
      if (data.kind === "whose" || (data.kind === "want" && isMine)) say("mine");
      else if (isMine) return;
      else if (data.kind === "mine" || data.lot <= lot) giveWay();
      else say("want"); // whoever came later has not heard it
    };
    say("want");
  });
}

function isHeld(id: string): Promise<boolean> {
  const channel = new BroadcastChannel(channelName);
  return new Promise<boolean>((resolve) => {
    channel.onmessage = ({ data }: MessageEvent<Call>) => data.kind === "mine" && data.id === id && resolve(true);
    setTimeout(() => resolve(false), answerMs);
    channel.postMessage({ kind: "whose", id, lot: 1 });
  }).finally(() => channel.close());
}
