import { DrillLoop, kTraceFloats } from "@web/worker/drill_loop";
import { kStill, type Steering } from "@web/worker/motion";
import { describe, expect, test } from "vitest";
import { FakeHand, FakeSession } from "./fake_core";

const pushing = (push_N: number): Steering => ({ ...kStill, push_N });

function makeLoop(hard?: (z: number) => number) {
  const session = new FakeSession(hard);
  const hand = new FakeHand();
  return { session, hand, loop: new DrillLoop(session, hand, 0, 50) };
}

/** Runs until `ms`, from the last call on. */
function run(loop: DrillLoop, from_ms: number, ms: number): void {
  for (let now = from_ms; now <= ms; now += 4) loop.advanceTo(now);
}

describe("the live loop", () => {
  test("runs a cycle a millisecond while something pushes, with a clock that never falls", () => {
    const { session, loop } = makeLoop();
    loop.steer(pushing(1));
    for (let ms = 0; ms <= 200; ms += 4.3) loop.advanceTo(ms);
    expect(session.steps.length).toBeGreaterThanOrEqual(196);
    expect(session.steps.length).toBeLessThanOrEqual(200);
    session.steps.forEach(
      (step, i) => void (i > 0 && expect(step[0]).toBeGreaterThan(session.steps[i - 1]![0]!)),
    );
  });

  test("makes up a stall only in part", () => {
    const { loop } = makeLoop();
    loop.steer(pushing(1));
    loop.advanceTo(0);
    expect(loop.advanceTo(10_000)).toBe(40);
  });

  test("rests while nothing pushes, and time goes on", () => {
    const { session, loop } = makeLoop();
    run(loop, 0, 12);
    const first = session.steps.length;
    run(loop, 16, 1000);
    expect(session.steps.length).toBe(first);
    loop.steer(pushing(1));
    loop.advanceTo(1010);
    expect(session.steps.at(-1)![0]).toBeGreaterThan(980_000);
  });

  test("batches hold every cycle once, in order", () => {
    const { loop } = makeLoop();
    loop.steer(pushing(1));
    loop.advanceTo(0);
    loop.advanceTo(10);
    const a = loop.takeBatch()!;
    loop.advanceTo(25);
    const b = loop.takeBatch()!;
    expect([a.first_seq, a.poses.length, a.cycle]).toEqual([0, 10, 10]);
    expect([b.first_seq, b.poses.length, b.cycle]).toEqual([10, 15, 25]);
    expect(loop.takeBatch()).toBeNull();
  });

  test("bone stops the bit, pushes the hand back, and lets go of both when nothing pushes", () => {
    const wall = (z: number): number => (z >= 0 ? 1e9 : 0);
    const { loop, session } = makeLoop(wall);
    loop.steer(pushing(10));
    run(loop, 0, 2000);
    const held = loop.readings();
    expect(held.depth_mm).toBeGreaterThanOrEqual(0);
    expect(held.depth_mm, "it ran into the wall within one cycle at 100 mm/s").toBeLessThan(0.11);
    expect(held.thrust_N).toBeCloseTo(10, 2);
    expect(held.push_N).toBe(10);
    loop.steer(kStill);
    run(loop, 2004, 4000);
    expect(loop.readings().thrust_N).toBeLessThan(0.03);
    const rested = session.steps.length;
    run(loop, 4004, 5000);
    expect(session.steps.length, "then it rests").toBe(rested);
  });

  test("the same push is slow in hard bone, quicker in soft, and plunges behind it, up to the chuck", () => {
    const { loop } = makeLoop((z) => (z < 0 ? 0 : z < 2 ? 12 : z < 4 ? 3 : 0));
    loop.steer(pushing(15));
    const depths: number[] = [];
    for (let ms = 0; ms < 20_000; ms += 4) {
      loop.advanceTo(ms);
      depths.push(loop.readings().depth_mm);
    }
    const reached = (depth: number): number => 4 * depths.findIndex((at) => at >= depth);
    const took = (from: number, to: number): number => reached(to) - reached(from);
    expect(took(0.5, 1.5)).toBeGreaterThan(2 * took(2.5, 3.5));
    expect(took(2.5, 3.5)).toBeGreaterThan(2 * (took(10, 20) / 10));
    expect(loop.readings().depth_mm, "15 N against a stop of 20 N/mm").toBeCloseTo(50.75, 1);
  });

  test("draws the bit, and sends the server the hand that pulls at it", () => {
    const { loop, hand } = makeLoop((z) => (z >= 0 ? 1e9 : 0));
    loop.steer(pushing(20));
    run(loop, 0, 2000);
    const bit_mm = loop.readings().tip[2];
    expect(bit_mm).toBe(loop.readings().depth_mm);
    const sent_mm = loop.takeBatch()!.poses.at(-1)!.tip[2];
    expect(sent_mm).toBe(hand.at()[2]);
    expect(sent_mm - bit_mm, "20 N over 5 N/mm").toBeCloseTo(4, 2);
  });

  test("the trace holds time, depth, force and push, in order", () => {
    const { loop } = makeLoop(() => 5);
    loop.steer(pushing(8));
    run(loop, 0, 400);
    const rows = loop.takeTrace();
    expect(rows.length).toBe(kTraceFloats * Math.floor(loop.readings().cycle / 8));
    const last = rows.slice(-kTraceFloats);
    expect(last[0]).toBeCloseTo(0.4, 1);
    expect(last[3]).toBe(8);
    expect(loop.takeTrace().length).toBe(0);
  });
});
