// What the arm does, millisecond by millisecond: how hard it pushes, where it aims, how it leans. Pure: no clock, no
// events; one call a cycle. Where the drill then goes is not decided here: the core's hand and the bone do that.
import type { Vec3 } from "../contract/bodies";
import { add, cross, dot, norm, normalized, perpendiculars, scale, sub } from "../geometry/vec";

export const kCycle_s = 0.001;
/** As hard as an arm leans on a drill. */
export const kMostPush_N = 40;
/** Pulling back is done with the fingers. */
export const kMostPull_N = 6;
/** Between hand and bit: under 10 N the hand is 2 mm ahead. The server's default too, so that it can agree. */
export const kStiffness_N_mm = 5;
/** Of a bit that turns: the core's default. */
export const kSpeed_rpm = 1000;
/**
 * The hand on the drill. Along it there is no spring: it goes on as long as it pushes. A hand that has pushed 15 N and
 * finds nothing moves 150 mm/s, so it plunges some 20 mm before a person reacts.
 */
export const kGrip = { mass_kg: 0.25, damping_N_s_mm: 0.1, across_N_mm: 2 } as const;

const kRise_N_s = 40;
const kFall_N_s = 400;
/** A wheel has no position to let go of: what its notches asked for fades. */
const kWheelFades_s = 0.7;
const kSideways_mm_s = 2;
/** The aim is never farther across than this, so no side force is above kLeash_mm * kGrip.across_N_mm. */
const kLeash_mm = 5;
const kTilt_rad_s = (6 * Math.PI) / 180;
const kMaxTilt_rad = (45 * Math.PI) / 180;
/** No cycle swings the far end of the bit farther than this. */
const kMaxSwing_mm = 0.01;
/** The drill may be led this far beside the path. */
const kReach_mm = 60;
/** A drill begins this far outside the lead; drawn back farther it would leave the picture. */
export const kStandOff_mm = 6;
const kStop_N_mm = 20;

/** What the person asks for now. */
export interface Steering {
  /** Along the drill, deeper is positive. */
  push_N: number;
  /** Across the drill, in the path frame's x and y, each of -1 .. 1. */
  sideways: [number, number];
  /** The shank leans towards +x, +y. */
  tilt: [number, number];
  spinning: boolean;
}

export const kStill: Steering = { push_N: 0, sideways: [0, 0], tilt: [0, 0], spinning: true };

export interface Effort {
  /** What the arm pushes with by now. */
  push_N: number;
  /** Of the push asked for, what the wheel's notches ask for. */
  wheel_N: number;
  /** A point on the line that the arm holds the drill on, path frame. */
  aim: Vec3;
  /** Unit vector from shank to tip, path frame. */
  axis: Vec3;
  /** mm across the drill still to go from drags. */
  owed: [number, number];
}

export function startEffort(lead_mm: number): Effort {
  return { push_N: 0, wheel_N: 0, aim: [0, 0, -(lead_mm + kStandOff_mm)], axis: [0, 0, 1], owed: [0, 0] };
}

/** Adds a drag, at most two seconds' worth, so that the drill never runs on long after the pointer. */
export function owe(effort: Effort, across: [number, number]): Effort {
  const owed = across.map((v, i) => clamp(effort.owed[i]! + v, 2 * kSideways_mm_s)) as [number, number];
  return { ...effort, owed };
}

/** Adds to the wheel's push; a notch the other way takes it back first, and only the next one pulls. */
export function turnWheel(effort: Effort, push_N: number): Effort {
  const sum = effort.wheel_N + push_N;
  const crossed = effort.wheel_N * sum < 0;
  return { ...effort, wheel_N: crossed ? 0 : Math.max(-kMostPull_N, Math.min(kMostPush_N, sum)) };
}

/** False when nothing is asked for and nothing is left of what was. */
export function isAtWork(effort: Effort, steering: Steering): boolean {
  return (
    steering.push_N !== 0 ||
    effort.push_N !== 0 ||
    effort.wheel_N !== 0 ||
    [...steering.sideways, ...steering.tilt, ...effort.owed].some((v) => v !== 0)
  );
}

/**
 * One cycle of kCycle_s.
 * @param hand where the hand is; reach_mm how far the tested shaft goes, which tilting must not swing too fast.
 */
export function nextEffort(effort: Effort, steering: Steering, hand: Vec3, reach_mm: number): Effort {
  const axis = tilted(effort.axis, steering.tilt, reach_mm);
  const [right, up] = acrossAxes(axis);
  const side = kSideways_mm_s * kCycle_s;
  const owed = effort.owed.map((v) => clamp(v, side)) as [number, number];
  const x = clamp(clamp(steering.sideways[0], 1) * side + owed[0], side);
  const y = clamp(clamp(steering.sideways[1], 1) * side + owed[1], side);
  const moved = add(effort.aim, add(scale(right, x), scale(up, y)));
  const wheel_N = tidy(effort.wheel_N * (1 - kCycle_s / kWheelFades_s), 0.05);
  return {
    push_N: pushed(effort.push_N, Math.max(-kMostPull_N, clamp(steering.push_N + wheel_N, kMostPush_N))),
    wheel_N,
    aim: leashed(moved, hand, axis),
    axis,
    owed: [tidy(effort.owed[0] - owed[0], 1e-9), tidy(effort.owed[1] - owed[1], 1e-9)],
  };
}

/** An arm takes a while to lean on the drill, and far less to let go. */
function pushed(now_N: number, wanted_N: number): number {
  const grows = Math.abs(wanted_N) > Math.abs(now_N) && wanted_N * now_N >= 0;
  return now_N + clamp(wanted_N - now_N, (grows ? kRise_N_s : kFall_N_s) * kCycle_s);
}

function leashed(aim: Vec3, hand: Vec3, axis: Vec3): Vec3 {
  const off = sub(aim, hand);
  const across = sub(off, scale(axis, dot(off, axis)));
  const length = norm(across);
  const held = add(hand, length > kLeash_mm ? scale(across, kLeash_mm / length) : across);
  return held.map((v) => clamp(v, kReach_mm)) as Vec3;
}

/** What stops a hand at the ends of its way, path frame: the chuck meets the bone, or the arm is back where it began. */
export function stopForce(hand: Vec3, lead_mm: number, reach_mm: number): Vec3 {
  const past = hand[2] > reach_mm ? hand[2] - reach_mm : Math.min(0, hand[2] + lead_mm + kStandOff_mm);
  return [0, 0, past === 0 ? 0 : -kStop_N_mm * past];
}

/** The path frame's x and y, made perpendicular to the bit. */
export function acrossAxes(axis: Vec3): [Vec3, Vec3] {
  const x: Vec3 = [1, 0, 0];
  const flat = sub(x, scale(axis, dot(x, axis)));
  const right = norm(flat) > 1e-6 ? normalized(flat) : perpendiculars(axis)[0];
  return [right, cross(axis, right)];
}

function tilted(axis: Vec3, tilt: [number, number], reach_mm: number): Vec3 {
  if (tilt[0] === 0 && tilt[1] === 0) return axis;
  const angle = Math.min(kTilt_rad_s * kCycle_s, kMaxSwing_mm / Math.max(reach_mm, 1));
  // The shank leans towards +x when the tip's direction leans towards -x.
  const [right, up] = acrossAxes(axis);
  const leaned = normalized(
    add(axis, add(scale(right, -clamp(tilt[0], 1) * angle), scale(up, -clamp(tilt[1], 1) * angle))),
  );
  return leaned[2] >= Math.cos(kMaxTilt_rad) ? leaned : axis;
}

function clamp(v: number, limit: number): number {
  return Math.max(-limit, Math.min(limit, v));
}
function tidy(v: number, least: number): number {
  return Math.abs(v) < least ? 0 : v;
}
