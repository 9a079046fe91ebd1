import { Slots } from "@web/scene/slots";
import { addressOf, parseRoute, type Route } from "@web/state/route";
import { SeriesTable } from "@web/state/series";
import { niceStep } from "@web/ui/chart";
import { metricRows } from "@web/ui/metrics";
import { describe, expect, test } from "vitest";

describe("addresses", () => {
  const rooms: Route[] = [
    { room: "cases" },
    { room: "case", case_id: "c7k2m9xq", path_id: null },
    { room: "case", case_id: "c7k2m9xq", path_id: "p/1" },
    { room: "drill", case_id: "c 1", path_id: "p2" },
    { room: "replay", case_id: "c1", recording_id: "r9" },
  ];
  test.each(rooms.map((room) => [addressOf(room), room] as const))(
    "%s leads where it was made",
    (address, room) => {
      expect(parseRoute(address)).toEqual(room);
    },
  );

  test("what leads nowhere is said to", () => {
    expect(parseRoute("#/nonsense").room).toBe("unknown");
    expect(parseRoute("#/case/c1/dance").room).toBe("unknown");
  });
});

describe("slots of the splat buffer", () => {
  test("after any coming and going, exactly the wanted indices hold the slots in use", () => {
    let seed = 20260117;
    const random = (): number => {
      seed = (seed * 1103515245 + 12345) % 2147483648;
      return seed / 2147483648;
    };
    const slots = new Slots(64);
    const data = new Float64Array(64);
    const wanted = new Set<number>();
    for (let i = 0; i < 4000; ++i) {
      const index = Math.floor(random() * 60);
      if (random() < 0.5) {
        data[slots.take(index)] = index;
        wanted.add(index);
      } else {
        const move = slots.free(index);
        if (move) data[move.to] = data[move.from]!;
        wanted.delete(index);
      }
      expect(new Set(data.subarray(0, slots.size)), "seed 20260117").toEqual(wanted);
    }
  });

  test("a full buffer says so", () => {
    const slots = new Slots(1);
    expect(slots.take(5)).toBe(0);
    expect(slots.take(6)).toBe(-1);
  });

  test("changed stretches are joined when near, apart when far", () => {
    const slots = new Slots(9000);
    for (let i = 0; i < 9000; ++i) slots.take(i);
    expect(slots.takeDirty()).toEqual([[0, 9000]]);
    slots.take(3);
    slots.take(10);
    slots.take(8000);
    expect(slots.takeDirty()).toEqual([
      [3, 11],
      [8000, 8001],
    ]);
  });
});

describe("the replay's time", () => {
  // Cycles 1, 4, 7, 8 of 8, at 1 kHz with a pause of a second before cycle 7.
  const rows = [
    [0.5, 0, 0, 0],
    [0.503, 1, 2, 0],
    [1.506, 2, 4, 1],
    [1.507, 3, 1, 2],
  ].flat();
  const table = new SeriesTable(new Float32Array(rows), 8, 3);

  test("a cycle has its time, and the time its cycle", () => {
    expect(table.timeAt(1)).toBe(0);
    expect(table.timeAt(4)).toBeCloseTo(0.003, 6);
    expect(table.timeAt(8)).toBeCloseTo(1.007, 6);
    expect(table.cycleAt(0.003)).toBeCloseTo(4, 3);
    expect(table.cycleAt(99)).toBe(8);
    expect(table.cycleAt(0)).toBeCloseTo(1, 9);
  });
});

describe("metrics", () => {
  test("units are taken from the names", () => {
    expect(metricRows({ peak_thrust_N: 12.345, grade: "A", tip_error_mm: 0.5, nested: {} })).toEqual([
      { key: "tip_error_mm", name: "Tip off by", value: "0.50", unit: "mm" },
      { key: "peak_thrust_N", name: "Peak thrust", value: "12.35", unit: "N" },
      { key: "grade", name: "Grade", value: "A", unit: "" },
    ]);
  });
});

test("axis steps are round numbers", () => {
  expect([0.9, 3, 7, 12, 0.03].map(niceStep)).toEqual([1, 5, 10, 20, 0.05]);
});
