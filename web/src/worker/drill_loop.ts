// The live loop in the browser: as many 1 ms cycles as time has passed, poses kept for the server in batches.
import type { Vec3 } from "../contract/bodies";
import type { Pose } from "../contract/drill_messages";
import type { CoreSession } from "./core_api";
import { type BitState, isMoving, kStill, nextState, owe, type Steering, startState } from "./motion";

export interface Readings {
  cycle: number;
  depth_mm: number;
  thrust_N: number;
  removed: number;
  tip: Vec3;
  axis: Vec3;
  spinning: boolean;
  /** Cycles in the last second of real time; 0 while nothing moves. */
  rate_hz: number;
}

/** One batch for the server, and what the state was after it here. */
export interface Batch {
  first_seq: number;
  poses: Pose[];
  cycle: number;
  hash: string;
}

/** A thrust this small has faded. */
const kFaded_N = 1e-3;
/** After a stall of the tab, at most this much time is made up; the rest never happened. */
const kMaxCatchUp_ms = 40;

export class DrillLoop {
  private state: BitState;
  private steering: Steering = kStill;
  private last_ms: number | null = null;
  private owed_ms = 0;
  private t_us = 0;
  private seq = 0;
  private thrust_N = 0;
  private cycle = 0;
  private depth_mm = 0;
  private removed = 0;
  private poses: Pose[] = [];
  private steered = true;
  private rate = { since_ms: 0, cycles: 0, hz: 0 };
  /** Rows of depth, thrust, removed: what the chart draws; emptied by takeTrace. */
  private trace: number[] = [];

  constructor(
    private readonly session: CoreSession,
    lead_mm: number,
    private readonly reach_mm: number,
  ) {
    this.state = startState(lead_mm);
    this.depth_mm = this.state.tip[2];
  }

  steer(steering: Steering): void {
    if (steering.spinning !== this.steering.spinning) this.steered = true;
    this.steering = steering;
  }
  nudge(displacement: Vec3): void {
    this.state = owe(this.state, displacement, this.steering.feed_mm_s);
  }

  /** Runs the cycles that are due at `now_ms`; returns how many. While nothing moves none are: time passes alone. */
  advanceTo(now_ms: number): number {
    const elapsed = this.last_ms === null ? 0 : now_ms - this.last_ms;
    this.last_ms = now_ms;
    const idle = !this.steered && !isMoving(this.state, this.steering) && this.thrust_N < kFaded_N;
    if (idle) {
      this.t_us += Math.round(Math.min(elapsed, 1000) * 1000);
      this.countRate(now_ms, 0);
      return 0;
    }
    this.steered = false;
    this.owed_ms = Math.min(this.owed_ms + elapsed, kMaxCatchUp_ms);
    const due = Math.floor(this.owed_ms);
    this.owed_ms -= due;
    for (let i = 0; i < due; ++i) this.cycleOnce();
    this.countRate(now_ms, due);
    return due;
  }

  private cycleOnce(): void {
    this.state = nextState(this.state, this.steering, this.reach_mm);
    this.t_us += 1000;
    const { tip, axis } = this.state;
    const spinning = this.steering.spinning;
    const out = this.session.step(this.t_us, tip[0], tip[1], tip[2], axis[0], axis[1], axis[2], spinning);
    this.poses.push({ t_us: this.t_us, tip, axis, spinning });
    this.cycle = out.cycle;
    this.thrust_N = out.thrust_N;
    this.depth_mm = out.depth_mm;
    this.removed = out.removed_total;
    if (out.cycle % 8 === 0) this.trace.push(out.depth_mm, out.thrust_N, out.removed_total);
  }

  private countRate(now_ms: number, cycles: number): void {
    this.rate.cycles += cycles;
    const span = now_ms - this.rate.since_ms;
    if (span < 500) return;
    this.rate = { since_ms: now_ms, cycles: 0, hz: span < 2000 ? (this.rate.cycles * 1000) / span : 0 };
  }

  /** What happened since the last batch, or null. */
  takeBatch(): Batch | null {
    if (this.poses.length === 0) return null;
    const batch = {
      first_seq: this.seq,
      poses: this.poses,
      cycle: this.cycle,
      hash: this.session.stateHash(),
    };
    this.seq += this.poses.length;
    this.poses = [];
    return batch;
  }

  takeTrace(): Float32Array {
    const rows = new Float32Array(this.trace);
    this.trace = [];
    return rows;
  }

  readings(): Readings {
    const { tip, axis } = this.state;
    return {
      cycle: this.cycle,
      depth_mm: this.depth_mm,
      thrust_N: this.thrust_N,
      removed: this.removed,
      tip,
      axis,
      spinning: this.steering.spinning,
      rate_hz: this.rate.hz,
    };
  }
}
