// What is heard and felt: sound, rumble, a gamepad's levers, the live curve.
import { ForceTrace, kShown_s } from "@web/state/force_trace";
import { leverOf, rumbleOf } from "@web/state/gamepad";
import { soundOf } from "@web/state/sound";
import { kMostPush_N } from "@web/worker/motion";
import { describe, expect, test } from "vitest";

const idling = { speed_rpm: 1000, torque_Nmm: 0, density_mg_cm3: 0 };

describe("the sound", () => {
  test("a bit that stands is silent", () => {
    const sound = soundOf({ speed_rpm: 0, torque_Nmm: 12, density_mg_cm3: 900 });
    expect([sound.whine, sound.grind]).toEqual([0, 0]);
  });

  test("its pitch follows the speed, and drops under load", () => {
    expect(soundOf({ ...idling, speed_rpm: 2000 }).pitch_Hz).toBeCloseTo(2 * soundOf(idling).pitch_Hz, 9);
    expect(soundOf({ ...idling, torque_Nmm: 10 }).pitch_Hz).toBeLessThan(soundOf(idling).pitch_Hz);
  });

  test("bone is heard only while it is cut: louder with the load, brighter with its density", () => {
    expect(soundOf(idling).grind).toBe(0);
    const soft = soundOf({ ...idling, torque_Nmm: 1, density_mg_cm3: 250 });
    const hard = soundOf({ ...idling, torque_Nmm: 6, density_mg_cm3: 900 });
    expect(soft.grind).toBeGreaterThan(0);
    expect(hard.grind).toBeGreaterThan(soft.grind);
    expect(hard.grind_Hz).toBeGreaterThan(soft.grind_Hz);
    expect(hard.cutoff_Hz).toBeGreaterThan(soft.cutoff_Hz);
  });

  test("stays in range whatever is felt", () => {
    for (const torque_Nmm of [-5, 1e6, Number.NaN, Number.POSITIVE_INFINITY]) {
      for (const density_mg_cm3 of [0, 1e6, Number.NaN]) {
        const sound = soundOf({ speed_rpm: 1000, torque_Nmm, density_mg_cm3 });
        for (const v of Object.values(sound)) expect(Number.isFinite(v)).toBe(true);
        expect(Math.max(sound.whine, sound.grind)).toBeLessThanOrEqual(1);
        expect(sound.grind_Hz).toBeLessThan(8000);
      }
    }
  });
});

const button = (value: number) => ({ value, pressed: value > 0.5 });
const pad = (axes: number[], left = 0, right = 0) => ({
  axes,
  buttons: [...Array.from({ length: 6 }, () => button(0)), button(left), button(right)],
});

describe("a gamepad", () => {
  test("that rests asks for nothing, though its sticks never rest quite", () => {
    expect(leverOf(pad([0.05, -0.08, 0.1, 0], 0.02, 0.03))).toEqual({
      push: 0,
      sideways: [0, 0],
      tilt: [0, 0],
    });
    expect(leverOf({ axes: [], buttons: [] }).push).toBe(0);
  });

  test("pushes with its right trigger as far as it is drawn, and pulls with the left", () => {
    expect(leverOf(pad([0, 0, 0, 0], 0, 1)).push).toBe(1);
    const half = leverOf(pad([0, 0, 0, 0], 0, 0.5)).push;
    expect(half).toBeGreaterThan(0.4);
    expect(half).toBeLessThan(0.5);
    expect(leverOf(pad([0, 0, 0, 0], 1, 0)).push).toBe(-1);
  });

  test("aims with the left stick, up being up, and leans with the right", () => {
    const lever = leverOf(pad([1, 0, 0, -1]));
    expect(lever.sideways).toEqual([1, 0]);
    expect(lever.tilt).toEqual([0, 1]);
    expect(Math.hypot(...leverOf(pad([1, 1, 0, 0])).sideways)).toBeCloseTo(1, 9);
  });

  test("rumbles as hard as the bone pushes, and hums while the bit turns", () => {
    expect(rumbleOf(0, 0, false)).toEqual({ strong: 0, weak: 0 });
    expect(rumbleOf(kMostPush_N / 2, 0, true).strong).toBe(0.5);
    expect(rumbleOf(1e9, 1e9, true)).toEqual({ strong: 1, weak: 1 });
    expect(rumbleOf(5, 4, true).weak).toBeGreaterThan(rumbleOf(5, 0, true).weak);
    expect(rumbleOf(Number.NaN, Number.NaN, true).strong).toBe(0);
  });
});

describe("the live curve", () => {
  const rows = (from_s: number, count: number): Float32Array =>
    Float32Array.from(Array.from({ length: count }, (_, i) => [from_s + i * 0.01, 1, 5, 7]).flat());

  test("holds the last seconds only, push and thrust apart", () => {
    const trace = new ForceTrace();
    for (let s = 0; s < 30; ++s) trace.add(rows(s, 100));
    const [t_s, push_N, thrust_N] = trace.columns();
    expect(t_s.at(-1)! - t_s[0]!).toBeLessThanOrEqual(kShown_s);
    expect(t_s.length).toBeGreaterThan(990);
    expect([push_N.at(-1), thrust_N.at(-1)]).toEqual([7, 5]);
    expect(t_s.every((t, i) => i === 0 || t > t_s[i - 1]!)).toBe(true);
  });

  test("a rest lies on the floor", () => {
    const trace = new ForceTrace();
    trace.add(rows(0, 10));
    trace.add(rows(3, 1));
    const [t_s, push_N] = trace.columns();
    const rest = push_N.indexOf(0);
    expect(rest).toBe(10);
    expect(t_s[rest]).toBeCloseTo(0.1, 6);
    expect(push_N.slice(rest)).toEqual([0, 0, 7]);
    expect(t_s[rest + 1]).toBeCloseTo(3, 1);
  });
});
