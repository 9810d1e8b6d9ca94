import type { Browser, CDPSession } from "playwright-core";

interface TraceEvent {
  name: string;
  pid: number;
  tid: number;
  ts: number;
  dur?: number;
  tdur?: number;
  /** Of a profile, which belongs to the thread that its first event names. */
  id?: string;
  args?: { data?: ProfileChunk };
}

/** Of Chromium's sampling profiler: nodes of the call tree, and the node of each sample with the time since the one before. */
interface ProfileChunk {
  startTime?: number;
  cpuProfile?: { nodes?: ProfileNode[]; samples?: number[] };
  timeDeltas?: number[];
}

interface ProfileNode {
  id: number;
  parent?: number;
  callFrame: { functionName: string };
}

/** A task of the page's main thread, in milliseconds: by the clock, and what the thread computed in it. */
export interface Task {
  begin: number;
  end: number;
  wall: number;
  cpu: number;
}

/** The tasks of the page's main thread, and the marks that the page made, while a browser traces itself. */
export class Trace {
  readonly #events: TraceEvent[] = [];

  #marked: TraceEvent | undefined;

  private constructor(readonly session: CDPSession) {
    session.on("Tracing.dataCollected", ({ value }) => this.#events.push(...(value as unknown as TraceEvent[])));
  }

  /** `profile`: for what(): events, or functions too, which costs the page some time. */
  static async start(browser: Browser, profile?: "events" | "all"): Promise<Trace> {
    const session = await browser.newBrowserCDPSession();
    const trace = new Trace(session);
    await session.send("Tracing.start", {
      transferMode: "ReportEvents",
      traceConfig: {
        includedCategories: [
          "disabled-by-default-devtools.timeline",
          "blink.user_timing",
          ...(profile ? ["devtools.timeline", "v8"] : []),
          ...(profile === "all" ? ["disabled-by-default-v8.cpu_profiler"] : []),
        ],
      },
    });
    return trace;
  }

  /** `mark`: a mark that the page made; where it is, its main thread is. */
  async stop(mark: string): Promise<{ tasks: Task[]; marks: number[] }> {
    const complete = new Promise((done) => this.session.once("Tracing.tracingComplete", done));
    await this.session.send("Tracing.end");
    await complete;
    await this.session.detach();
    const marked = this.#events.filter(({ name }) => name === mark);
    const [first] = marked;
    this.#marked = first;
    if (!first) throw new Error(`The page made no mark "${mark}".`);
    const tasks = this.#events
      .filter(({ name, pid, tid, dur }) => name === "RunTask" && pid === first.pid && tid === first.tid && dur !== undefined)
      .map(({ ts, dur = 0, tdur = 0 }) => ({ begin: ts / 1000, end: (ts + dur) / 1000, wall: dur / 1000, cpu: tdur / 1000 }))
      .sort((a, b) => a.begin - b.begin);
    return { tasks, marks: this.marks(mark) };
  }

  /** When the page made marks of this name. Only after stop(). */
  marks(name: string): number[] {
    return this.#events
      .filter((one) => one.name === name)
      .map(({ ts }) => ts / 1000)
      .sort((a, b) => a - b);
  }

  /** What the thread did in the task, the longest first: events by what they computed, and functions by the clock, in milliseconds. */
  what(task: Task): string[] {
    const { pid, tid } = this.#marked!;
    const isIn = (one: TraceEvent) => one.pid === pid && one.tid === tid && one.name !== "RunTask" && isWithin(task, one.ts);
    const events = this.#events.filter(isIn).map(({ name, tdur = 0 }) => [name, tdur / 1000] as const);
    return [...events, ...this.#functions(task)]
      .filter(([, time]) => time > 0.3)
      .sort(([, a], [, b]) => b - a)
      .slice(0, 14)
      .map(([name, time]) => `${time.toFixed(1).padStart(7)}  ${name}`);
  }

  /** The time of each function, with those that have called it, if there is a profile. */
  #functions(task: Task): Map<string, number> {
    const { pid, tid } = this.#marked!;
    const profile = this.#events.find((one) => one.name === "Profile" && one.pid === pid && one.tid === tid)?.id;
    const nodes = new Map<number, ProfileNode>();
    const stackOf = (node: number | undefined) => {
      const stack: string[] = [];
      for (let at = node; at !== undefined && stack.length < 5; at = nodes.get(at)!.parent) {
        stack.push(nodes.get(at)!.callFrame.functionName || "(anonymous)");
      }
      return stack.join(" < ");
    };
    const own = new Map<string, number>();
    let now = 0;
    for (const { pid: process, id, args } of this.#events) {
      if (process !== pid || id === undefined || id !== profile) continue;
      const { startTime, cpuProfile, timeDeltas = [] } = args?.data ?? {};
      now = startTime ?? now;
      for (const node of cpuProfile?.nodes ?? []) nodes.set(node.id, node);
      cpuProfile?.samples?.forEach((node, k) => {
        now += timeDeltas[k] ?? 0;
        const stack = isWithin(task, now) ? stackOf(node) : "";
        if (stack && !/^\((program|idle)\)/.test(stack)) own.set(stack, (own.get(stack) ?? 0) + (timeDeltas[k] ?? 0) / 1000);
      });
    }
    return own;
  }
}

/** `at`: in microseconds. */
function isWithin({ begin, end }: Task, at: number): boolean {
  return at >= 1000 * begin && at <= 1000 * end;
}

/** The tasks of each mark but the first and the last: those from the mark on, or those up to it. */
export function tasksByMark(tasks: readonly Task[], marks: readonly number[], which: "after" | "before"): Task[][] {
  const found: Task[][] = marks.map(() => []);
  for (const task of tasks) {
    const k =
      which === "after" ? marks.findLastIndex((mark) => mark <= task.end) : marks.findIndex((mark) => mark >= task.begin);
    if (k >= 0) found[k]!.push(task);
  }
  return found.slice(1, -1).filter((some) => some.length > 0);
}
