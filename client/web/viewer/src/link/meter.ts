import { percentile } from "lpdeform-client/mesh/statistics";

/** What the last second has brought, and how long inputs took. Times are milliseconds of performance.now(). */
export class Meter {
  readonly #frames: { time: number; bytes: number }[] = [];
  readonly #latencies: number[] = [];
  readonly #services: number[] = [];
  readonly most: number;

  constructor(most = 2000) {
    this.most = most;
  }

  drawn(time: number, bytes: number): void {
    this.#frames.push({ time, bytes });
    this.#forget(time);
  }

  /** `latency`: from an input to the picture that answers it; `service`: the part of that between sending and receiving. */
  answered(latency: number, service: number): void {
    this.#latencies.push(latency);
    this.#services.push(service);
    if (this.#latencies.length > this.most) {
      this.#latencies.shift();
      this.#services.shift();
    }
  }

  framesPerSecond(now: number): number {
    this.#forget(now);
    return this.#frames.length;
  }

  bytesPerSecond(now: number): number {
    this.#forget(now);
    return this.#frames.reduce((sum, frame) => sum + frame.bytes, 0);
  }

  get inputs(): number {
    return this.#latencies.length;
  }

  /** NaN before the first input. */
  latency(share: number): number {
    return percentile(this.#latencies, share);
  }

  service(share: number): number {
    return percentile(this.#services, share);
  }

  reset(): void {
    this.#frames.length = this.#latencies.length = this.#services.length = 0;
  }

  #forget(now: number): void {
    while (this.#frames.length > 0 && this.#frames[0]!.time < now - 1000) this.#frames.shift();
  }
}
