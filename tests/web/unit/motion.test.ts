import type { Vec3 } from "@web/contract/bodies";
import { dot, norm, sub } from "@web/geometry/vec";
import {
  type Effort,
  isAtWork,
  kMostPull_N,
  kMostPush_N,
  kStill,
  nextEffort,
  owe,
  type Steering,
  startEffort,
  stopForce,
  turnWheel,
} from "@web/worker/motion";
import { describe, expect, test } from "vitest";

const kHand: Vec3 = [0, 0, -6];
function after(ms: number, steering: Steering, effort: Effort = startEffort(0)): Effort {
  let now = effort;
  for (let i = 0; i < ms; ++i) now = nextEffort(now, steering, kHand, 50);
  return now;
}

describe("the arm", () => {
  test("leans on the drill at 40 N a second, and lets go at once", () => {
    const pushing = { ...kStill, push_N: 20 };
    expect(after(250, pushing).push_N).toBeCloseTo(10, 6);
    const full = after(2000, pushing);
    expect(full.push_N).toBe(20);
    expect(after(51, kStill, full).push_N).toBe(0);
    expect(isAtWork(after(51, kStill, full), kStill)).toBe(false);
  });

  test("never pushes or pulls harder than an arm can, whatever is asked", () => {
    expect(after(5000, { ...kStill, push_N: 1e9 }).push_N).toBe(kMostPush_N);
    expect(after(5000, { ...kStill, push_N: -1e9 }).push_N).toBe(-kMostPull_N);
  });

  test("each notch of the wheel pushes more, and what they asked for fades", () => {
    const turned = turnWheel(turnWheel(startEffort(0), 3), 3);
    expect(turned.wheel_N).toBe(6);
    const pushing = after(150, kStill, turned);
    expect(pushing.push_N).toBeGreaterThan(3);
    expect(pushing.push_N).toBeLessThan(6);
    expect(isAtWork(after(4000, kStill, turned), kStill), "fades to nothing").toBe(false);
  });

  test("a notch back takes the push away first, and only the next one pulls", () => {
    const turned = turnWheel(startEffort(0), 2);
    expect(turnWheel(turned, -3).wheel_N).toBe(0);
    expect(turnWheel(turnWheel(turned, -3), -3).wheel_N).toBe(-3);
    let far = turned;
    for (let i = 0; i < 100; ++i) far = turnWheel(far, 3);
    expect(far.wheel_N).toBe(kMostPush_N);
  });

  test("a drag moves the aim by as much, and ends", () => {
    const dragged = after(2000, kStill, owe(startEffort(0), [0.5, -0.25]));
    expect(isAtWork(dragged, kStill)).toBe(false);
    expect(dragged.aim[0]).toBeCloseTo(0.5, 9);
    expect(dragged.aim[1]).toBeCloseTo(-0.25, 9);
  });

  test("an aim is never far from a hand that bone holds, so side forces are bounded", () => {
    const { aim, axis } = after(20_000, { ...kStill, sideways: [1, 1], tilt: [0.3, 0] });
    const off = sub(aim, kHand);
    expect(norm(off)).toBeCloseTo(5, 6);
    expect(dot(off, axis)).toBeCloseTo(0, 9);
  });

  test("leaning turns the shank, slowly and up to a limit", () => {
    const lean = { ...kStill, tilt: [1, 0] as [number, number] };
    let now = startEffort(0);
    let swung = 0;
    for (let i = 0; i < 20_000; ++i) {
      const next = nextEffort(now, lean, kHand, 50);
      swung = Math.max(swung, norm(sub(next.axis, now.axis)) * 50);
      now = next;
    }
    // The far end of 50 mm swings by no more than 0.01 mm a cycle.
    expect(swung).toBeLessThan(0.01 + 1e-9);
    // The shank leans towards +x, so the tip points towards -x.
    expect(now.axis[0]).toBeLessThan(-0.5);
    expect(norm(now.axis)).toBeCloseTo(1, 9);
    expect(now.axis[2]).toBeGreaterThanOrEqual(Math.cos(Math.PI / 4));
  });

  test("the ends of the way push back, and nothing does between them", () => {
    expect(stopForce([0, 0, 20], 5, 50)).toEqual([0, 0, 0]);
    expect(stopForce([1, 2, 51], 5, 50)).toEqual([0, 0, -20]);
    expect(stopForce([0, 0, -13], 5, 50)).toEqual([0, 0, 40]);
  });
});
