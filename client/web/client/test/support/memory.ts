import { readFileSync } from "node:fs";
import type { Service } from "./service.js";

/** MiB: what the page's scripts hold, what the browser's processes do with pictures and buffers, the server, and Envoy. */
export type Held = Record<"page" | "browser" | "server" | "envoy", number>;

const mebibyte = 2 ** 20;

/** What is held from sample to sample while something is repeated, and whether it grows. */
export class Memory {
  readonly samples: Held[] = [];

  constructor(readonly service: Service) {}

  /** `scripts`: bytes; `processes`: of the browser, by number. */
  add({ scripts, processes }: { scripts: number; processes: number[] }): Held {
    const held = {
      page: scripts / mebibyte,
      browser: processes.reduce((sum, id) => sum + proportionalBytes(id), 0) / mebibyte,
      server: this.service.residentBytes("server") / mebibyte,
      envoy: this.service.residentBytes("envoy") / mebibyte,
    };
    this.samples.push(held);
    return held;
  }

  /** In MiB, with one digit. */
  static row(held: Held): string[] {
    return Object.values(held).map((value) => value.toFixed(1));
  }

  /** One line for each; `isFlat`: the first quarter warms caches and pools, from then on nothing grows by a tenth and 2 MiB. */
  verdicts(): { text: string; isFlat: boolean }[] {
    const { samples } = this;
    const quarter = Math.floor(samples.length / 4);
    return (["page", "browser", "server", "envoy"] as const).map((who) => {
      const mean = (part: Held[]) => part.reduce((sum, held) => sum + held[who], 0) / part.length;
      const [before, after] = [mean(samples.slice(quarter, 2 * quarter)), mean(samples.slice(-quarter))];
      const isFlat = after <= 1.1 * before + 2;
      return {
        text: `${who}: ${before.toFixed(1)} MiB, then ${after.toFixed(1)} MiB${isFlat ? "" : ": it grows"}`,
        isFlat,
      };
    });
  }
}

/** Memory that processes share counts in parts. 0 where the process has ended. */
function proportionalBytes(pid: number): number {
  try {
    return 1024 * Number(/^Pss:\s+(\d+)/m.exec(readFileSync(`/proc/${pid}/smaps_rollup`, "utf8"))![1]);
  } catch {
    return 0;
  }
}
