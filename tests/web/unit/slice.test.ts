import type { Vec3, VolumeBody } from "@web/contract/bodies";
import { bitSolid, holeSolid, sectionOf } from "@web/geometry/section";
import {
  kPlanes,
  kViews,
  patientToPixel,
  pixelToPatient,
  renderSlice,
  samplePatient,
  sliceGeometry,
} from "@web/geometry/slice";
import {
  add,
  cross,
  dot,
  norm,
  normalized,
  perpendiculars,
  scale,
  toLocal,
  toPatient,
} from "@web/geometry/vec";
import { describe, expect, test } from "vitest";

/** A tilted, anisotropic volume whose HU is a linear function of the patient's coordinates. */
const slope: Vec3 = [3, -2, 5];
function linearVolume(): VolumeBody {
  const w = normalized([0.2, -0.1, 1]);
  const [u, v] = perpendiculars(w);
  const dims: Vec3 = [40, 30, 12];
  const spacing: Vec3 = [0.5, 0.6, 2];
  const origin: Vec3 = [-10, 100, -500];
  const hu = new Int16Array(dims[0] * dims[1] * dims[2]);
  const volume: VolumeBody = { dims, spacing, origin, axes: [u, v, w], hu };
  for (let k = 0, at = 0; k < dims[2]; ++k) {
    for (let j = 0; j < dims[1]; ++j) {
      for (let i = 0; i < dims[0]; ++i, ++at) {
        const p = add(scale(u, i * spacing[0]), add(scale(v, j * spacing[1]), scale(w, k * spacing[2])));
        hu[at] = Math.round(100 + dot(slope, p));
      }
    }
  }
  return volume;
}
const expected = (volume: VolumeBody, p: Vec3): number =>
  100 + dot(slope, [p[0] - volume.origin[0], p[1] - volume.origin[1], p[2] - volume.origin[2]]);

describe("slices", () => {
  test("sampling a tilted anisotropic volume gives the patient's HU", () => {
    const volume = linearVolume();
    const inside = add(
      volume.origin,
      add(scale(volume.axes[0], 7.3), add(scale(volume.axes[1], 8.1), scale(volume.axes[2], 9.7))),
    );
    // Voxels are rounded to whole HU: half a unit at most, and trilinear weights add up to one.
    expect(Math.abs(samplePatient(volume, inside) - expected(volume, inside))).toBeLessThanOrEqual(0.5);
  });

  test("the outermost voxel centres are inside, what lies beyond is not", () => {
    const volume = linearVolume();
    expect(samplePatient(volume, volume.origin)).toBe(100);
    expect(samplePatient(volume, add(volume.origin, scale(volume.axes[2], -0.1)))).toBe(-2000);
  });

  test("a slice has square pixels in patient millimetres, whatever the voxels are", () => {
    const volume = linearVolume();
    for (const plane of kPlanes) {
      const g = sliceGeometry(volume, plane, [0, 105, -490]);
      const here = pixelToPatient(g, 10, 10);
      expect(norm(sub(pixelToPatient(g, 11, 10), here))).toBeCloseTo(0.5, 12);
      expect(norm(sub(pixelToPatient(g, 10, 11), here))).toBeCloseTo(0.5, 12);
      const back = patientToPixel(g, here);
      expect(back[0]).toBeCloseTo(10, 9);
      expect(back[1]).toBeCloseTo(10, 9);
    }
  });

  test("letters agree with the axes: the patient's left on the right, the head on top", () => {
    expect(kViews.transaxial.right).toEqual([1, 0, 0]);
    expect(kViews.transaxial.letters).toEqual({ left: "R", right: "L", top: "A", bottom: "P" });
    expect(kViews.coronal.down).toEqual([0, 0, -1]);
    expect(kViews.sagittal.letters).toEqual({ left: "A", right: "P", top: "H", bottom: "F" });
    for (const plane of kPlanes) {
      const { right, down, through } = kViews[plane];
      expect(Math.abs(cross(right, down)[through])).toBe(1);
    }
  });

  test("the picture shows what sampling gives at each pixel", () => {
    const volume = linearVolume();
    const point = add(
      volume.origin,
      add(scale(volume.axes[0], 9), add(scale(volume.axes[1], 8), scale(volume.axes[2], 11))),
    );
    for (const plane of kPlanes) {
      const g = sliceGeometry(volume, plane, point);
      const rgba = new Uint8ClampedArray(4 * g.width * g.height);
      renderSlice(volume, g, { width_HU: 255, level_HU: 127.5 }, rgba);
      const [column, row] = patientToPixel(g, point).map(Math.round) as [number, number];
      const hu = samplePatient(volume, pixelToPatient(g, column, row));
      // Grey is the HU itself here, rounded.
      expect(Math.abs(rgba[4 * (row * g.width + column)]! - hu)).toBeLessThanOrEqual(0.5 + 1e-6);
    }
  });
});

function sub(a: Vec3, b: Vec3): Vec3 {
  return add(a, scale(b, -1));
}

/** By the shoelace formula, over the two coordinates that are not `through`. */
function area(polygon: Vec3[], through: number): number {
  const [x, y] = [0, 1, 2].filter((a) => a !== through) as [number, number];
  let sum = 0;
  polygon.forEach((p, i) => {
    const q = polygon[(i + 1) % polygon.length]!;
    sum += p[x]! * q[y]! - q[x]! * p[y]!;
  });
  return Math.abs(sum) / 2;
}

/** A circle's polygon of 48 corners is smaller than the circle by sin(a)/a, a = 2 pi / 48. */
const kPolygon = Math.sin((2 * Math.PI) / 48) / ((2 * Math.PI) / 48);

describe("cross-sections", () => {
  test("a hole along z is cut in a circle of its own radius", () => {
    const hole = holeSolid([5, 6, 7], [0, 0, 1], 30, 3);
    const section = sectionOf(hole, 2, 20);
    expect(area(section, 2)).toBeCloseTo(Math.PI * 1.5 ** 2 * kPolygon, 9);
    expect(sectionOf(hole, 2, 38)).toEqual([]);
  });

  test("a tilted hole is cut in an ellipse, longer by one over the cosine", () => {
    const axis = normalized([1, 0, 2]);
    const section = sectionOf(holeSolid([0, 0, 0], axis, 40, 3), 2, 15);
    expect(area(section, 2)).toBeCloseTo((Math.PI * 1.5 ** 2 * kPolygon) / axis[2], 9);
  });

  test("a hole along the plane is cut in a rectangle", () => {
    const section = sectionOf(holeSolid([0, 0, 0], [1, 0, 0], 40, 3), 2, 0);
    expect(area(section, 2)).toBeCloseTo(40 * 3, 6);
  });

  test("the bit's cone is cut in a circle that grows from the apex", () => {
    const bit = bitSolid([0, 0, 10], [0, 0, 1], { diameter_mm: 3, cone_length_mm: 5, length_mm: 50 });
    expect(area(sectionOf(bit, 2, 8), 2)).toBeCloseTo(Math.PI * (1.5 * (2 / 5)) ** 2 * kPolygon, 9);
    expect(area(sectionOf(bit, 2, 0), 2)).toBeCloseTo(Math.PI * 1.5 ** 2 * kPolygon, 9);
    expect(sectionOf(bit, 2, 10.5)).toEqual([]);
  });
});

describe("frames", () => {
  test("patient to path and back is the identity", () => {
    const z = normalized([0.3, -0.9, 0.1]);
    const [x, y] = perpendiculars(z);
    const frame = { origin_patient: [10, -200, 3000] as Vec3, axes: [x, y, z] as [Vec3, Vec3, Vec3] };
    const p: Vec3 = [12.5, -190, 3010];
    const back = toPatient(frame, toLocal(frame, p));
    for (let a = 0; a < 3; ++a) expect(back[a]).toBeCloseTo(p[a]!, 9);
    expect(dot(cross(x, y), z)).toBeCloseTo(1, 12);
  });
});
