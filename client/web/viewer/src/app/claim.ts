const prefix = "lpdeform-work-";
const channelName = "lpdeform-claims";
/** How long an active page may take to answer. */
const answerMs = 250;

interface Call {
  kind: "whose" | "want" | "mine";
  id: string;
  lot: number;
}

/**
 * Whether this page alone has the work, from now on and for as long as it lives. It uses the browser's locks. Without them, as
 * on pages from plain HTTP, it asks the other pages.
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

/** Acts on the work while no other page has it or can take it; does nothing if another page has it. */
export async function whileFree(id: string, act: () => Promise<void>): Promise<void> {
  if (navigator.locks) await navigator.locks.request(prefix + id, { ifAvailable: true }, (lock) => lock && act());
  else if (!(await isHeld(id))) await act();
}

async function claimByAsking(id: string, waitMs: number): Promise<boolean> {
  const until = performance.now() + waitMs;
  while (!(await contend(id))) if (performance.now() >= until) return false;
  return true;
}

/**
 * If several pages ask at once, the page with the smallest random number gets the work. The page that has it answers from then
 * on.
 */
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
      else say("want"); // pages that came later have not heard it
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
