// The rows that the player gives for plotting: t_s, depth_mm, thrust_N, removed_mm3; of cycle 1, of every stride-th
// after it, and of the last. Pure.

const kRow = 4;

export class SeriesTable {
  private readonly rows: number;

  constructor(
    private readonly series: Float32Array,
    private readonly cycles: number,
    private readonly stride: number,
  ) {
    this.rows = Math.floor(series.length / kRow);
  }

  /** Seconds from the first cycle; the clock may have run on while nothing moved. */
  timeAt(cycle: number): number {
    if (this.rows < 2 || cycle <= 1) return 0;
    const row = Math.min(Math.floor((cycle - 1) / this.stride), this.rows - 2);
    const part = (cycle - this.cycleOf(row)) / (this.cycleOf(row + 1) - this.cycleOf(row));
    return this.time(row) + part * (this.time(row + 1) - this.time(row));
  }

  cycleAt(time_s: number): number {
    if (this.rows < 2) return this.cycles;
    let low = 0;
    let high = this.rows - 1;
    if (time_s >= this.time(high)) return this.cycles;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.time(middle) <= time_s) low = middle;
      else high = middle;
    }
    const span = this.time(high) - this.time(low);
    const part = span > 0 ? Math.max(0, (time_s - this.time(low)) / span) : 0;
    return this.cycleOf(low) + part * (this.cycleOf(high) - this.cycleOf(low));
  }

  plots(): { thrust_over_depth: number[]; depth_over_time: number[] } {
    const thrust_over_depth: number[] = [];
    const depth_over_time: number[] = [];
    for (let row = 0; row < this.rows; ++row) {
      const depth = this.series[row * kRow + 1]!;
      thrust_over_depth.push(depth, this.series[row * kRow + 2]!);
      depth_over_time.push(this.time(row), Math.max(0, depth));
    }
    return { thrust_over_depth, depth_over_time };
  }

  private cycleOf(row: number): number {
    return Math.min(1 + row * this.stride, this.cycles);
  }
  private time(row: number): number {
    return this.series[row * kRow]! - this.series[0]!;
  }
}
