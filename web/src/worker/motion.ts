// From what the hand asks for to the bit's next pose. Pure: no clock, no events; one call a cycle.
import type { Vec3 } from "../contract/bodies";
import { add, cross, dot, norm, normalized, perpendiculars, scale, sub } from "../geometry/vec";

/** No cycle moves any part of the bit farther than this, so nothing is jumped over. */
export const kMaxStep_mm = 0.02;
export const kCycle_s = 0.001;
const kSideways_mm_s = 2;
const kTilt_rad_s = (6 * Math.PI) / 180;
const kMaxTilt_rad = (45 * Math.PI) / 180;
/** The bit may be led this far beside and before the path; no deeper than its tested length, where its chuck begins. */
const kReach_mm = 60;

/** What the hand asks for now: each of -1 .. 1, and displacements still owed from a drag or a wheel. */
export interface Steering {
  /** Along the bit, +1 deeper. */
  advance: number;
  /** Across the bit, in the path frame's x and y. */
  sideways: [number, number];
  /** The shank leans towards +x, +y. */
  tilt: [number, number];
  spinning: boolean;
  /** How fast +1 advances. */
  feed_mm_s: number;
}

export const kStill: Steering = { advance: 0, sideways: [0, 0], tilt: [0, 0], spinning: true, feed_mm_s: 1 };

export interface BitState {
  tip: Vec3;
  /** Unit vector from shank to tip, path frame. */
  axis: Vec3;
  /** mm still to go from drags and wheel notches: across (x, y) and along the bit. */
  owed: Vec3;
}

export function startState(lead_mm: number): BitState {
  return { tip: [0, 0, -(lead_mm + 6)], axis: [0, 0, 1], owed: [0, 0, 0] };
}

/** Adds a drag or a wheel notch, at most a few seconds' worth, so that the bit never runs on long after the hand. */
export function owe(state: BitState, displacement: Vec3, feed_mm_s: number): BitState {
  const limit: Vec3 = [2 * kSideways_mm_s, 2 * kSideways_mm_s, 2 * Math.max(feed_mm_s, 1)];
  const owed = add(state.owed, displacement).map((v, i) => clamp(v, limit[i]!)) as Vec3;
  return { ...state, owed };
}

export function isMoving(state: BitState, steering: Steering): boolean {
  return (
    steering.advance !== 0 ||
    steering.sideways.some((v) => v !== 0) ||
    steering.tilt.some((v) => v !== 0) ||
    state.owed.some((v) => v !== 0)
  );
}

/** One cycle of kCycle_s. `reach_mm` is how far the tested shaft goes: tilting must not swing its end too fast. */
export function nextState(state: BitState, steering: Steering, reach_mm: number): BitState {
  const axis = tilted(state.axis, steering.tilt, reach_mm);
  const [right, up] = acrossAxes(axis);
  const feed = Math.min(steering.feed_mm_s * kCycle_s, kMaxStep_mm / 2);
  const side = Math.min(kSideways_mm_s * kCycle_s, kMaxStep_mm / 2);
  const owed = state.owed.map((v, i) => clamp(v, i === 2 ? feed : side)) as Vec3;
  const along = clamp(clamp(steering.advance, 1) * feed + owed[2], kMaxStep_mm / 2);
  const x = clamp(clamp(steering.sideways[0], 1) * side + owed[0], kMaxStep_mm / 2);
  const y = clamp(clamp(steering.sideways[1], 1) * side + owed[1], kMaxStep_mm / 2);
  const moved = add(state.tip, add(scale(axis, along), add(scale(right, x), scale(up, y))));
  return { tip: withinReach(moved, reach_mm), axis, owed: sub(state.owed, owed).map(tidy) as Vec3 };
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
  const angle = Math.min(kTilt_rad_s * kCycle_s, kMaxStep_mm / 2 / Math.max(reach_mm, 1));
  // The shank leans towards +x when the tip's direction leans towards -x.
  const [right, up] = acrossAxes(axis);
  const leaned = normalized(
    add(axis, add(scale(right, -clamp(tilt[0], 1) * angle), scale(up, -clamp(tilt[1], 1) * angle))),
  );
  return leaned[2] >= Math.cos(kMaxTilt_rad) ? leaned : axis;
}

function withinReach(tip: Vec3, reach_mm: number): Vec3 {
  const [x, y, z] = tip.map((v) => clamp(v, kReach_mm)) as Vec3;
  return [x, y, Math.min(z, reach_mm)];
}
function clamp(v: number, limit: number): number {
  return Math.max(-limit, Math.min(limit, v));
}
function tidy(v: number): number {
  return Math.abs(v) < 1e-9 ? 0 : v;
}
