// Push and thrust over the last seconds of simulated time, as columns for a plotter.
import { kTraceFloats } from "../worker/drill_loop";

export const kShown_s = 10;
/** Rows farther apart have a rest between them. */
const kRest_s = 0.1;

export class ForceTrace {
  private readonly t_s: number[] = [];
  private readonly push_N: number[] = [];
  private readonly thrust_N: number[] = [];

  /** Rows of kTraceFloats, in order of time. */
  add(rows: Float32Array): void {
    for (let i = 0; i + kTraceFloats <= rows.length; i += kTraceFloats) {
      const t_s = rows[i]!;
      // Over a rest nothing was pushed: the line goes along the floor, not across it.
      const last = this.t_s.at(-1);
      if (last !== undefined && t_s - last > kRest_s) {
        this.push(last + 0.01, 0, 0);
        this.push(t_s - 0.01, 0, 0);
      }
      this.push(t_s, rows[i + 3]!, rows[i + 2]!);
    }
    const end = this.end_s;
    let gone = 0;
    while (gone < this.t_s.length && this.t_s[gone]! < end - kShown_s) ++gone;
    for (const column of [this.t_s, this.push_N, this.thrust_N]) column.splice(0, gone);
  }

  get end_s(): number {
    return this.t_s.at(-1) ?? 0;
  }
  /** Time, push, thrust. */
  columns(): [number[], number[], number[]] {
    return [this.t_s, this.push_N, this.thrust_N];
  }

  private push(t_s: number, push_N: number, thrust_N: number): void {
    this.t_s.push(t_s);
    this.push_N.push(push_N);
    this.thrust_N.push(thrust_N);
  }
}
