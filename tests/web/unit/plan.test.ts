import type { Vec3 } from "@web/contract/bodies";
import type { NewPath, PathInfo } from "@web/contract/rest";
import { pathFrame } from "@web/geometry/path_frame";
import { pixelToPatient, type SliceGeometry } from "@web/geometry/slice";
import { cross, dot, norm, normalized, sub } from "@web/geometry/vec";
import { kWhole, panned, type Zoom, zoomAbout, zoomed } from "@web/geometry/zoom";
import { bitWith, commonBitOf, kCommonBits, kDiameter_mm, kLength_mm } from "@web/state/bits";
import { edited, historyOf, kMostUndone, redone, sealed, undone } from "@web/state/history";
import { escaped, kNotMeasuring, measureText, shownIn, withPoint, withTool } from "@web/state/measure";
import {
  drawnFrom,
  kShortest_mm,
  lengthOf,
  mirrored,
  newPath,
  type Plan,
  type PlannedPath,
  plannedFrom,
  withBit,
  withEnd,
  without,
} from "@web/state/plan";
import { kPresets, presetOfKey, windowAfterDrag } from "@web/state/windowing";
import { describe, expect, test } from "vitest";
import { kFrames } from "./path_frames";

function randoms(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state * 1103515245 + 12345) % 2147483648;
    return state / 2147483648;
  };
}

const path = (key: string, label = key): PlannedPath => ({
  key,
  label,
  entry_patient: [20, 40, 10],
  target_patient: [8, 5, 12],
  bit: { diameter_mm: 3, cone_length_mm: 5, length_mm: 50 },
  volume_radius_mm: 4,
  lead_mm: 4,
  spacing_mm: 0.1,
});

describe("the frame of a path", () => {
  test.each(kFrames)("from $entry to $target is the server's", ({ entry, target, axes }) => {
    const frame = pathFrame(entry, target);
    // Two multiplications, an addition and a root apart at most: a few units in the last place.
    for (let a = 0; a < 3; ++a)
      for (let c = 0; c < 3; ++c) expect(Math.abs(frame.axes[a]![c]! - axes[a]![c]!)).toBeLessThan(4e-15);
    expect(frame.origin_patient).toEqual(entry);
  });

  test("is right-handed, with its z towards the target and its x near the axis least along it", () => {
    const random = randoms(20261123);
    for (let i = 0; i < 500; ++i) {
      const point = (): Vec3 => [random() - 0.5, random() - 0.5, random() - 0.5].map((v) => 200 * v) as Vec3;
      const [entry, target] = [point(), point()];
      const [x, y, z] = pathFrame(entry, target).axes;
      const along = normalized(sub(target, entry));
      expect(norm(sub(z, along)), `seed 20261123, case ${i}`).toBeLessThan(1e-14);
      expect(norm(sub(cross(x, y), z))).toBeLessThan(1e-14);
      expect(Math.abs(dot(x, z))).toBeLessThan(1e-14);
      const least = along.map(Math.abs).indexOf(Math.min(...along.map(Math.abs)));
      expect(x[least]).toBe(Math.max(...x.map(Math.abs)));
    }
  });
});

describe("the plan", () => {
  const plan: Plan = [path("a", "left pedicle"), path("b")];

  test("an end that is moved changes its own path only, and what is drawn of it", () => {
    const next = withEnd(plan, "a", "target", [20, 0, 10]);
    expect(next[1]).toBe(plan[1]);
    expect(next[0]!.target_patient).toEqual([20, 0, 10]);
    expect(lengthOf(next[0]!)).toBe(40);
    const drawn = drawnFrom(next[0]!);
    expect(drawn.length_mm).toBe(40);
    expect(drawn.frame.axes[2]).toEqual([0, -1, 0]);
  });

  test("ends never meet: there would be no direction to drill in", () => {
    const near = withEnd(plan, "a", "target", [20, 40, 10 + 0.9 * kShortest_mm]);
    expect(near[0]!.target_patient).toEqual(plan[0]!.target_patient);
  });

  test("a thick bit gets bone around it; a thin one keeps what there was", () => {
    const thick = withBit(plan, "a", bitWith(plan[0]!.bit, { diameter_mm: 7.5 }));
    expect(thick[0]!.volume_radius_mm).toBe(4.75);
    expect(withBit(plan, "a", bitWith(plan[0]!.bit, { diameter_mm: 2.5 }))[0]!.volume_radius_mm).toBe(4);
  });

  test("bits stay within what can be planned, and the common ones are among them", () => {
    const { bit } = plan[0]!;
    expect(bitWith(bit, { diameter_mm: 99 }).diameter_mm).toBe(kDiameter_mm.high);
    expect(bitWith(bit, { length_mm: 1 }).length_mm).toBe(kLength_mm.low);
    expect(bitWith(bit, { diameter_mm: Number.NaN }).diameter_mm).toBe(kDiameter_mm.low);
    for (const one of kCommonBits) {
      const set = bitWith(bit, one);
      expect([set.diameter_mm, set.length_mm]).toEqual([one.diameter_mm, one.length_mm]);
      expect(commonBitOf(set)).toBe(one);
    }
  });

  test("mirroring twice is where one began, and names change sides", () => {
    const right = mirrored(plan, "c", plan[0]!, 3);
    expect(right.label).toBe("right pedicle");
    expect(right.entry_patient).toEqual([-14, 40, 10]);
    const back = mirrored([], "a", right, 3);
    expect(back).toEqual(plan[0]);
  });

  test("a new path takes the chosen one's bit and a name of its own", () => {
    const made = newPath(plan, "n", [1, 2, 3], { ...plan[0]!, bit: { ...plan[0]!.bit, diameter_mm: 6.5 } });
    expect(made.bit.diameter_mm).toBe(6.5);
    expect(plan.map(({ label }) => label)).not.toContain(made.label);
    expect(made.target_patient[1]).toBeLessThan(made.entry_patient[1]); // to the front
  });

  test("what the server says becomes what is edited", () => {
    const info = { ...path("x"), id: "p1", points: 5, retired: false } as unknown as PathInfo;
    const planned = plannedFrom(info);
    expect(planned.key).toBe("p1");
    expect(Object.keys(planned)).not.toContain("points");
    expect(planned.entry_patient satisfies NewPath["entry_patient"]).toEqual([20, 40, 10]);
    expect(without([planned], "p1")).toEqual([]);
  });
});

describe("undo and redo", () => {
  test("go back and forth through every edit, whatever they were", () => {
    const random = randoms(7);
    let history = historyOf(0);
    const seen = [0];
    for (let n = 1; n <= 100; ++n) {
      history = edited(history, random(), random() < 0.5 ? null : String(n));
      seen.push(history.present);
    }
    for (const was of seen.slice(0, -1).reverse()) {
      history = undone(history);
      expect(history.present).toBe(was);
    }
    expect(undone(history)).toEqual(history);
    for (const was of seen.slice(1)) {
      history = redone(history);
      expect(history.present).toBe(was);
    }
    expect(redone(history)).toEqual(history);
  });

  test("a drag is undone in one step, and the next drag by itself", () => {
    let history = historyOf("start");
    for (const step of ["a", "b", "c"]) history = edited(history, step, "drag entry");
    history = edited(sealed(history), "d", "drag entry");
    history = undone(history);
    expect(history.present).toBe("c");
    expect(undone(history).present).toBe("start");
  });

  test("an edit after an undo forgets what was undone; an edit that changes nothing is none", () => {
    let history = undone(edited(edited(historyOf(1), 2), 3));
    expect(edited(history, 2)).toBe(history);
    history = edited(history, 9);
    expect(history.future).toEqual([]);
    expect(undone(history).present).toBe(2);
  });

  test("an undone drag does not swallow the next edit of the same kind", () => {
    const history = edited(undone(edited(edited(historyOf(1), 2, "drag"), 3, "drag")), 4, "drag");
    expect(undone(history).present).toBe(1);
  });

  test("what is remembered has an end", () => {
    let history = historyOf(0);
    for (let n = 1; n <= 2 * kMostUndone; ++n) history = edited(history, n);
    expect(history.past.length).toBe(kMostUndone);
  });
});

const whole: SliceGeometry = {
  plane: "coronal",
  width: 120,
  height: 90,
  pixel_mm: 0.5,
  corner: [-30, 7, 45],
};

describe("zoom", () => {
  test("what lies under the pointer stays there, unless the picture's edge is in the way", () => {
    const random = randoms(11);
    let zoom: Zoom = kWhole;
    let stayed = 0;
    for (let i = 0; i < 500; ++i) {
      const [column, row] = [random() * 119, random() * 89];
      const before = pixelToPatient(zoomed(whole, zoom), column, row);
      const next = zoomAbout(whole, zoom, random() < 0.5 ? 1.25 : 0.8, column, row);
      const g = zoomed(whole, next);
      if (next.factor >= zoom.factor) {
        expect(norm(sub(pixelToPatient(g, column, row), before)), `seed 11, case ${i}`).toBeLessThan(1e-9);
        ++stayed;
      }
      expect(g.corner[1]).toBe(7);
      expect(next.left).toBeGreaterThanOrEqual(0);
      expect(next.left + 119 / next.factor).toBeLessThanOrEqual(119 + 1e-9);
      zoom = next;
    }
    expect(stayed).toBeGreaterThan(100);
  });

  test("all the way out is the whole picture again", () => {
    let zoom = zoomAbout(whole, kWhole, 8, 100, 20);
    expect(zoomed(whole, zoom).pixel_mm).toBe(whole.pixel_mm / 8);
    zoom = panned(whole, zoom, -1000, 1000);
    for (let i = 0; i < 12; ++i) zoom = zoomAbout(whole, zoom, 0.8, 3, 80);
    expect(zoomed(whole, zoom)).toEqual(whole);
  });
});

describe("windows", () => {
  test("keys 1 to 5 are the presets of the report", () => {
    expect(
      ["1", "2", "3", "4", "5"].map((key) => {
        const { width_HU, level_HU } = presetOfKey(key)!.window;
        return `${width_HU}/${level_HU}`;
      }),
    ).toEqual(["400/40", "1500/-600", "150/90", "2500/480", "80/40"]);
    expect(presetOfKey("6")).toBeNull();
  });

  test("a drag widens to the right and raises the level downwards, and never leaves its bounds", () => {
    const from = kPresets[0]!.window;
    const wider = windowAfterDrag(from, 100, 0);
    expect(wider.width_HU).toBeGreaterThan(from.width_HU);
    expect(wider.level_HU).toBe(from.level_HU);
    expect(windowAfterDrag(from, 0, 50).level_HU).toBeGreaterThan(from.level_HU);
    expect(windowAfterDrag(from, -1e6, -1e6)).toEqual({ width_HU: 1, level_HU: -3000 });
  });
});

describe("measuring", () => {
  test("a length is in patient millimetres", () => {
    let m = withTool(kNotMeasuring, "length");
    m = withPoint(m, "transaxial", [0, 0, 5]);
    expect(m.open?.points.length).toBe(1);
    m = withPoint(m, "transaxial", [3, 4, 5]);
    expect(m.open).toBeNull();
    expect(measureText(m.done[0]!)).toBe("5.0 mm");
  });

  test("an angle is the one at its second point", () => {
    let m = withTool(kNotMeasuring, "angle");
    for (const p of [
      [10, 0, 0],
      [0, 0, 0],
      [5, 0, 5],
    ] as Vec3[])
      m = withPoint(m, "coronal", p);
    expect(measureText(m.done[0]!)).toBe("45.0°");
    expect(
      measureText({
        ...m.done[0]!,
        points: [
          [1, 1, 1],
          [1, 1, 1],
          [2, 1, 1],
        ],
      }),
    ).toBe("");
  });

  test("is shown in its own slice only, and grows with the pointer", () => {
    let m = withTool(kNotMeasuring, "length");
    m = withPoint(m, "sagittal", [5, 0, 0]);
    expect(measureText(shownIn(m, "sagittal", 5, 0.25, [5, 0, 2])[0]!)).toBe("2.0 mm");
    m = withPoint(m, "sagittal", [5, 9, 0]);
    expect(shownIn(m, "sagittal", 5.2, 0.25, null).length).toBe(1);
    expect(shownIn(m, "sagittal", 5.4, 0.25, null)).toEqual([]);
    expect(shownIn(m, "coronal", 5, 0.25, null)).toEqual([]);
  });

  test("a point in another plane begins anew; Escape drops what is begun, then all", () => {
    let m = withTool(kNotMeasuring, "length");
    m = withPoint(withPoint(m, "sagittal", [5, 0, 0]), "coronal", [1, 2, 3]);
    expect(m.open).toEqual({ kind: "length", plane: "coronal", points: [[1, 2, 3]] });
    m = withPoint(withPoint(m, "coronal", [1, 2, 4]), "coronal", [0, 2, 0]);
    expect([m.done.length, m.open?.points.length]).toEqual([1, 1]);
    m = escaped(m);
    expect([m.done.length, m.open, m.tool]).toEqual([1, null, "length"]);
    expect(escaped(m)).toEqual(kNotMeasuring);
    expect(withTool(m, "length").tool).toBe("crosshair");
  });
});
