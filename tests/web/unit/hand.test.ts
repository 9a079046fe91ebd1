import { screenAcross } from "@web/geometry/screen";
import { type HandEvent, handAfter, kRestingHand, steeringOf } from "@web/state/steering";
import { isAtWork, kMostPull_N, kMostPush_N, startEffort } from "@web/worker/motion";
import { describe, expect, test } from "vitest";

const after = (...events: HandEvent[]) => events.reduce(handAfter, kRestingHand);

describe("the hand", () => {
  test("a key that is held pushes with the strength chosen, and opposed keys cancel", () => {
    const push = after({ type: "strength", push_N: 20 }, { type: "press", action: "push" });
    expect(steeringOf(push).push_N).toBe(20);
    const both = handAfter(push, { type: "press", action: "pull" });
    expect(steeringOf(both).push_N).toBe(0);
    expect(steeringOf(handAfter(both, { type: "release", action: "pull" })).push_N).toBe(20);
    expect(steeringOf(handAfter(both, { type: "release", action: "push" })).push_N).toBe(-kMostPull_N);
  });

  test("a pad pushes as far as it is moved, up to all that an arm can", () => {
    expect(steeringOf(after({ type: "pad_push", value: 0.25 })).push_N).toBe(kMostPush_N / 4);
    expect(steeringOf(after({ type: "pad_push", value: -0.5 })).push_N).toBe(-kMostPull_N / 2);
    const all = after(
      { type: "pad_push", value: 1 },
      { type: "press", action: "push" },
      { type: "gamepad", lever: { push: 1, sideways: [0, 0], tilt: [0, 0] } },
    );
    expect(steeringOf(all).push_N).toBe(kMostPush_N);
  });

  test("letting go of everything pushes nothing, and the bit spins on", () => {
    const gone = after(
      { type: "press", action: "left" },
      { type: "press", action: "push" },
      { type: "pad_push", value: 1 },
      { type: "gamepad", lever: { push: 1, sideways: [1, 1], tilt: [1, 0] } },
      { type: "release_all" },
    );
    expect(isAtWork(startEffort(0), steeringOf(gone))).toBe(false);
    expect(steeringOf(gone).spinning).toBe(true);
  });

  test("left is the screen's left, however the camera is turned", () => {
    const turned = after({ type: "screen", right: [0, 1], up: [-1, 0] }, { type: "press", action: "left" });
    const { sideways } = steeringOf(turned);
    expect(sideways[0]).toBeCloseTo(0, 12);
    expect(sideways[1]).toBeCloseTo(-1, 12);
  });

  test("fine control is a quarter", () => {
    const fine = after(
      { type: "strength", push_N: 20 },
      { type: "press", action: "push" },
      { type: "fine", on: true },
    );
    expect(steeringOf(fine).push_N).toBe(5);
  });
});

describe("the screen's directions across the path", () => {
  test("looking down the path they are the screen's own", () => {
    expect(screenAcross([1, 0], [0, -1], [0, 0])).toEqual({ right: [1, 0], up: [0, -1] });
  });

  test("looking from the side, up means away from the viewer when the screen's up is the path", () => {
    const { right, up } = screenAcross([0.9, 0], [0, 0], [0, 1]);
    expect(right).toEqual([1, 0]);
    expect(up[1]).toBeCloseTo(1, 12);
  });

  test("they are always at right angles", () => {
    for (let i = 0; i < 50; ++i) {
      const v = (k: number): [number, number] => [Math.sin(i * 1.3 + k), Math.cos(i * 0.7 + 2 * k)];
      const { right, up } = screenAcross(v(0), v(1), v(2));
      expect(right[0] * up[0] + right[1] * up[1]).toBeCloseTo(0, 12);
      expect(Math.hypot(...right)).toBeCloseTo(1, 12);
    }
  });
});
