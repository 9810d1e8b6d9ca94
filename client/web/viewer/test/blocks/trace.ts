import type { Browser, CDPSession } from "playwright-core";

interface TraceEvent {
  name: string;
  pid: number;
  tid: number;
  ts: number;
  dur?: number;
  tdur?: number;
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

  private constructor(readonly session: CDPSession) {
    session.on("Tracing.dataCollected", ({ value }) => this.#events.push(...(value as unknown as TraceEvent[])));
  }

  static async start(browser: Browser): Promise<Trace> {
    const session = await browser.newBrowserCDPSession();
    const trace = new Trace(session);
    await session.send("Tracing.start", {
      transferMode: "ReportEvents",
      traceConfig: { includedCategories: ["disabled-by-default-devtools.timeline", "blink.user_timing"] },
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
    if (!first) throw new Error(`The page made no mark "${mark}".`);
    const tasks = this.#events
      .filter(({ name, pid, tid, dur }) => name === "RunTask" && pid === first.pid && tid === first.tid && dur !== undefined)
      .map(({ ts, dur = 0, tdur = 0 }) => ({ begin: ts / 1000, end: (ts + dur) / 1000, wall: dur / 1000, cpu: tdur / 1000 }))
      .sort((a, b) => a.begin - b.begin);
    return { tasks, marks: marked.map(({ ts }) => ts / 1000).sort((a, b) => a - b) };
  }
}

/** For each mark but the first and the last its longest task: of those from the mark on, or of those up to it. */
export function longestByMark(tasks: readonly Task[], marks: readonly number[], which: "after" | "before"): Task[] {
  const longest: (Task | undefined)[] = marks.map(() => undefined);
  for (const task of tasks) {
    const k =
      which === "after" ? marks.findLastIndex((mark) => mark <= task.end) : marks.findIndex((mark) => mark >= task.begin);
    if (k >= 0 && task.wall > (longest[k]?.wall ?? 0)) longest[k] = task;
  }
  return longest.slice(1, -1).filter((task) => task !== undefined);
}
