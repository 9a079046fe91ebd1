import type { Vec3 } from "@web/contract/bodies";
import { screenAcross } from "@web/geometry/screen";
import { dot, norm, scale } from "@web/geometry/vec";
import { type HandEvent, handAfter, kRestingHand, steeringOf } from "@web/state/steering";
import { type BitState, isMoving, kMaxStep_mm, kStill, nextState, owe, startState } from "@web/worker/motion";
import { describe, expect, test } from "vitest";

const after = (...events: HandEvent[]) => events.reduce(handAfter, kRestingHand);

describe("the hand", () => {
  test("keys that are held add up, and cancel when opposed", () => {
    expect(steeringOf(after({ type: "press", action: "advance" })).advance).toBe(1);
    const both = after({ type: "press", action: "advance" }, { type: "press", action: "withdraw" });
    expect(steeringOf(both).advance).toBe(0);
    expect(steeringOf(handAfter(both, { type: "release", action: "withdraw" })).advance).toBe(1);
  });

  test("letting go of everything stops the bit but not the spin", () => {
    const gone = after(
      { type: "press", action: "left" },
      { type: "pad_advance", value: 1 },
      { type: "release_all" },
    );
    expect(isMoving(startState(0), steeringOf(gone))).toBe(false);
    expect(steeringOf(gone).spinning).toBe(true);
  });

  test("left is the screen's left, however the camera is turned", () => {
    const turned = after({ type: "screen", right: [0, 1], up: [-1, 0] }, { type: "press", action: "left" });
    const { sideways } = steeringOf(turned);
    expect(sideways[0]).toBeCloseTo(0, 12);
    expect(sideways[1]).toBeCloseTo(-1, 12);
  });

  test("fine control is a quarter", () => {
    expect(steeringOf(after({ type: "press", action: "advance" }, { type: "fine", on: true })).advance).toBe(
      0.25,
    );
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

/** How far the farthest of the tip and the shaft's end moved. */
function largestStep(a: BitState, b: BitState, reach: number): number {
  const end = (s: BitState): Vec3 => s.tip.map((v, i) => v - s.axis[i]! * reach) as Vec3;
  const gap = (p: Vec3, q: Vec3): number => norm(p.map((v, i) => v - q[i]!) as Vec3);
  return Math.max(gap(a.tip, b.tip), gap(end(a), end(b)));
}

describe("motion", () => {
  test("advancing goes along the bit at the feed asked for", () => {
    let state = startState(2);
    for (let i = 0; i < 1000; ++i) state = nextState(state, { ...kStill, advance: 1, feed_mm_s: 2 }, 50);
    expect(state.tip[2] - startState(2).tip[2]).toBeCloseTo(2, 9);
    expect(state.tip[0]).toBe(0);
  });

  test("no cycle moves any part of the bit farther than the limit, whatever is asked", () => {
    let state = owe(startState(0), [1e9, -1e9, 1e9], 10);
    for (let i = 0; i < 5000; ++i) {
      const wild = { ...kStill, feed_mm_s: 1e6, advance: Math.sin(i) * 1e6 };
      const steering = {
        ...wild,
        sideways: [1e6, -1e6] as [number, number],
        tilt: [1e6, Math.cos(i) * 1e6] as [number, number],
      };
      const next = nextState(state, steering, 50);
      // Three components of at most half the limit each, and a turn of at most half: within twice half times sqrt 3.
      expect(largestStep(state, next, 50)).toBeLessThanOrEqual(kMaxStep_mm * 1.5);
      expect(norm(next.axis)).toBeCloseTo(1, 9);
      state = next;
    }
  });

  test("a drag is worked off and ends exactly", () => {
    let state = owe(startState(0), [0.5, 0, -0.25], 1);
    const start = state.tip;
    for (let i = 0; i < 2000; ++i) state = nextState(state, kStill, 50);
    expect(isMoving(state, kStill)).toBe(false);
    expect(state.tip[0] - start[0]).toBeCloseTo(0.5, 9);
    expect(state.tip[2] - start[2]).toBeCloseTo(-0.25, 9);
  });

  test("leaning turns the shank about a tip that stays, up to a limit", () => {
    let state = startState(0);
    for (let i = 0; i < 60000; ++i) state = nextState(state, { ...kStill, tilt: [1, 0] }, 50);
    expect(state.tip).toEqual(startState(0).tip);
    // The shank leans towards +x, so the tip points towards -x.
    expect(state.axis[0]).toBeLessThan(-0.5);
    expect(dot(state.axis, [0, 0, 1])).toBeGreaterThanOrEqual(Math.cos(Math.PI / 4));
    expect(scale(state.axis, 1)[1]).toBeCloseTo(0, 9);
  });
});
