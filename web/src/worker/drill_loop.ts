// The live loop in the browser: as many 1 ms cycles as time has passed, each of them an arm that pushes a hand, a hand
// that pulls at the bit, and bone that pushes back. The hand's poses are kept for the server in batches.
import type { Vec3 } from "../contract/bodies";
import type { Pose } from "../contract/drill_messages";
import { add, norm } from "../geometry/vec";
import type { CoreHand, CoreSession, StepOutput } from "./core_api";
import {
  type Effort,
  isAtWork,
  kCycle_s,
  kStill,
  nextEffort,
  owe,
  type Steering,
  startEffort,
  stopForce,
  turnWheel,
} from "./motion";

export interface Readings {
  cycle: number;
  depth_mm: number;
  /** What the bone pushes back with along the drill. */
  thrust_N: number;
  /** What the arm pushes with. */
  push_N: number;
  /** What the bone holds the bit with against its turning. */
  torque_Nmm: number;
  /** Of the bone cut lately; 0 while none is. */
  density_mg_cm3: number;
  removed: number;
  /** Of the bit. */
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

/** A row of the trace: simulated seconds, depth, thrust, push. */
export const kTraceFloats = 4;
const kTraceEvery = 8;
/** A hand that was slower than this for so many cycles stands, whatever it leans on. */
const kStanding_mm_s = 1e-2;
const kStandsAfter = 50;
/** After a stall of the tab, at most this much time is made up; the rest never happened. */
const kMaxCatchUp_ms = 40;
/** Part of the density shown that a cycle renews. */
const kDensityRenews = 0.03;

export class DrillLoop {
  private effort: Effort;
  private steering: Steering = kStill;
  private felt: StepOutput | null = null;
  private last_ms: number | null = null;
  private owed_ms = 0;
  private t_us = 0;
  private seq = 0;
  private still_cycles = kStandsAfter;
  private density_mg_cm3 = 0;
  private poses: Pose[] = [];
  private steered = true;
  private rate = { since_ms: 0, cycles: 0, hz: 0 };
  private trace: number[] = [];

  constructor(
    private readonly session: CoreSession,
    private readonly hand: CoreHand,
    private readonly lead_mm: number,
    private readonly reach_mm: number,
  ) {
    this.effort = startEffort(lead_mm);
    hand.place(this.effort.aim);
  }

  steer(steering: Steering): void {
    if (steering.spinning !== this.steering.spinning) this.steered = true;
    this.steering = steering;
  }
  /** Moves the aim across the drill, mm. */
  nudge(across: [number, number]): void {
    this.effort = owe(this.effort, across);
  }
  wheel(push_N: number): void {
    this.effort = turnWheel(this.effort, push_N);
  }

  /** Runs the cycles that are due at `now_ms`; returns how many. While nothing moves none are: time passes alone. */
  advanceTo(now_ms: number): number {
    const elapsed = this.last_ms === null ? 0 : now_ms - this.last_ms;
    this.last_ms = now_ms;
    if (this.isIdle()) {
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

  private isIdle(): boolean {
    if (this.steered || isAtWork(this.effort, this.steering)) return false;
    return this.still_cycles >= kStandsAfter;
  }

  private cycleOnce(): void {
    const { hand, lead_mm, reach_mm, steering } = this;
    const from = hand.at();
    this.effort = nextEffort(this.effort, steering, from, reach_mm);
    const { axis, push_N, aim } = this.effort;
    const back = add(this.felt?.hand_force_N ?? [0, 0, 0], stopForce(from, lead_mm, reach_mm));
    hand.step(kCycle_s, axis, push_N, aim, back);
    this.still_cycles = norm(hand.velocity()) < kStanding_mm_s ? this.still_cycles + 1 : 0;
    this.t_us += Math.round(kCycle_s * 1e6);
    const tip = hand.at();
    const { spinning } = steering;
    const felt = this.session.step(this.t_us, tip[0], tip[1], tip[2], axis[0], axis[1], axis[2], spinning);
    this.poses.push({ t_us: this.t_us, tip, axis, spinning });
    this.density_mg_cm3 += kDensityRenews * (felt.density_mg_cm3 - this.density_mg_cm3);
    this.felt = felt;
    if (felt.cycle % kTraceEvery === 0) {
      this.trace.push(this.t_us * 1e-6, felt.depth_mm, felt.thrust_N, push_N);
    }
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
      cycle: this.felt!.cycle,
      hash: this.session.stateHash(),
    };
    this.seq = (this.seq + this.poses.length) >>> 0;
    this.poses = [];
    return batch;
  }

  /** Rows of kTraceFloats since the last call. */
  takeTrace(): Float32Array {
    const rows = new Float32Array(this.trace);
    this.trace = [];
    return rows;
  }

  readings(): Readings {
    const { felt, effort } = this;
    const tip = felt?.tip ?? effort.aim;
    return {
      cycle: felt?.cycle ?? 0,
      depth_mm: felt?.depth_mm ?? tip[2],
      thrust_N: felt?.thrust_N ?? 0,
      push_N: effort.push_N,
      torque_Nmm: felt ? 0 - felt.torque_Nmm[2] : 0,
      density_mg_cm3: this.density_mg_cm3,
      removed: felt?.removed_total ?? 0,
      tip,
      axis: felt?.axis ?? effort.axis,
      spinning: this.steering.spinning,
      rate_hz: this.rate.hz,
    };
  }
}
