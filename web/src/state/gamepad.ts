// A gamepad of the standard layout to the arm, and the force back to its motors. Pure.
import { kMostPush_N } from "../worker/motion";
import type { Lever } from "./steering";

/** What a Gamepad is used for here. */
export interface PadState {
  axes: readonly number[];
  buttons: readonly { value: number; pressed: boolean }[];
}

const kLeftTrigger = 6;
const kRightTrigger = 7;
/** Starts and stops the spin: the lowest of the four buttons at the right. */
export const kSpinButton = 0;
const kStickRests = 0.12;
const kTriggerRests = 0.04;

/** The right trigger pushes, the left pulls, the left stick aims, the right leans. */
export function leverOf(pad: PadState): Lever {
  const trigger = (button: number): number => beyond(pad.buttons[button]?.value ?? 0, kTriggerRests);
  const stick = (first: number): [number, number] => {
    const x = pad.axes[first] ?? 0;
    const down = pad.axes[first + 1] ?? 0;
    const size = Math.hypot(x, down);
    if (size === 0) return [0, 0];
    const wanted = beyond(Math.min(1, size), kStickRests) / size;
    return [x * wanted, down === 0 ? 0 : -down * wanted];
  };
  return { push: trigger(kRightTrigger) - trigger(kLeftTrigger), sideways: stick(0), tilt: stick(2) };
}

function beyond(v: number, rests: number): number {
  return Number.isFinite(v) ? Math.max(0, Math.min(1, (v - rests) / (1 - rests))) : 0;
}

export interface Rumble {
  /** The slow heavy motor and the quick light one, 0 .. 1. */
  strong: number;
  weak: number;
}

/** The heavy motor goes with the force, the light one with the cutting. */
export function rumbleOf(thrust_N: number, torque_Nmm: number, spinning: boolean): Rumble {
  const part = (v: number): number => (Number.isFinite(v) ? Math.max(0, Math.min(1, v)) : 0);
  return {
    strong: part(Math.abs(thrust_N) / kMostPush_N),
    weak: spinning ? part(0.08 + Math.abs(torque_Nmm) / 20) : 0,
  };
}
