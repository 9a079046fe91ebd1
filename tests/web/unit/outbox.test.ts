import type { Batch } from "@web/worker/drill_loop";
import { kMostUnanswered, Outbox } from "@web/worker/outbox";
import { describe, expect, test } from "vitest";

/** Poses told apart by their time: it is their number. */
function batch(first_seq: number, count: number, cycle = first_seq + count): Batch {
  const poses = Array.from({ length: count }, (_, i) => ({
    t_us: first_seq + i,
    tip: [0, 0, 0] as [number, number, number],
    axis: [0, 0, 1] as [number, number, number],
    spinning: true,
  }));
  return { first_seq, poses, cycle, hash: `after ${cycle}` };
}
function outboxOf(...batches: Batch[]): Outbox {
  const made = new Outbox({ cycle: 0, hash: "start" });
  for (const each of batches) expect(made.add(each)).toBe(true);
  return made;
}
const waiting = (outbox: Outbox): [number, number][] =>
  outbox.batches.map(({ first_seq, poses }) => [first_seq, poses.length]);

describe("what is not answered yet", () => {
  test("goes out of the box with its answer, which may answer several batches", () => {
    const outbox = outboxOf(batch(0, 3), batch(3, 2), batch(5, 4));
    expect(outbox.answered(4)).toEqual({ cycle: 5, hash: "after 5" });
    expect(waiting(outbox)).toEqual([[5, 4]]);
    expect(outbox.answered(4), "answered before").toBeNull();
    expect(outbox.answered(6), "in the middle of a batch").toBeNull();
    expect(waiting(outbox)).toEqual([[5, 4]]);
  });

  test("is sent again from where the server was: nothing taken, some, all", () => {
    const all = outboxOf(batch(0, 3), batch(3, 2));
    expect(all.resume(0)).toEqual({ state: { cycle: 0, hash: "start" } });
    expect(waiting(all)).toEqual([
      [0, 3],
      [3, 2],
    ]);
    expect(all.resume(3)).toEqual({ state: { cycle: 3, hash: "after 3" } });
    expect(waiting(all)).toEqual([[3, 2]]);
    expect(all.resume(5)).toEqual({ state: { cycle: 5, hash: "after 5" } });
    expect(waiting(all)).toEqual([]);
  });

  test("a batch that was taken in part is cut, and keeps what its end should be", () => {
    const outbox = outboxOf(batch(0, 3), batch(3, 4), batch(7, 1));
    expect(outbox.resume(5), "within a batch no state is known").toEqual({ state: null });
    expect(waiting(outbox)).toEqual([
      [5, 2],
      [7, 1],
    ]);
    expect(outbox.batches[0]!.poses.map(({ t_us }) => t_us)).toEqual([5, 6]);
    expect(outbox.answered(6)).toEqual({ cycle: 7, hash: "after 7" });
  });

  test("a server that asks for what is gone, or for what never was, cannot be gone on with", () => {
    const outbox = outboxOf(batch(0, 3), batch(3, 2), batch(5, 1));
    outbox.answered(2);
    expect(outbox.resume(2)).toBeNull();
    expect(outbox.resume(7)).toBeNull();
    expect(new Outbox({ cycle: 0, hash: "start" }).resume(1)).toBeNull();
  });

  test("numbers wrap", () => {
    const top = 0xffff_fff0;
    const outbox = outboxOf(batch(top, 10, 10), batch(top + 10, 10, 20), batch(4, 3, 23));
    expect(outbox.answered(top + 9)).toEqual({ cycle: 10, hash: "after 10" });
    expect(outbox.resume(0xffff_fffe)).toEqual({ state: null });
    expect(waiting(outbox)).toEqual([
      [0xffff_fffe, 6],
      [4, 3],
    ]);
    expect(outbox.resume(1)).toEqual({ state: null });
    expect(waiting(outbox)[0]).toEqual([1, 3]);
    expect(outbox.answered(3)).toEqual({ cycle: 20, hash: "after 20" });
    expect(outbox.resume(0xffff_ffff), "before what was answered").toBeNull();
  });

  test("is bounded, and what was answered makes room", () => {
    const outbox = outboxOf(batch(0, kMostUnanswered - 4), batch(kMostUnanswered - 4, 4));
    expect(outbox.add(batch(kMostUnanswered, 1))).toBe(false);
    outbox.resume(kMostUnanswered - 3);
    expect(outbox.add(batch(kMostUnanswered, 1)), "a part of a batch makes room too").toBe(true);
    outbox.answered(kMostUnanswered - 1);
    expect(outbox.add(batch(kMostUnanswered + 1, kMostUnanswered - 1))).toBe(true);
    expect(outbox.add(batch(0, 1))).toBe(false);
  });
});
