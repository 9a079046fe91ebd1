// Slices of a CT in patient axes: where a plane lies, what HU it shows. Every view derives from one patient point.
import type { Vec3, VolumeBody } from "../contract/bodies";
import { add, dot, scale, sub } from "./vec";

export type Plane = "transaxial" | "coronal" | "sagittal";
export const kPlanes: readonly Plane[] = ["transaxial", "coronal", "sagittal"];

/** How a radiologist looks at each plane. Patient axes: x to the left, y to the back, z to the head. */
export interface PlaneView {
  /** Patient axis across the picture to the right, and its sign. */
  right: Vec3;
  /** Patient axis down the picture. */
  down: Vec3;
  /** Index of the patient axis through the plane. */
  through: 0 | 1 | 2;
  letters: { left: string; right: string; top: string; bottom: string };
}

export const kViews: Record<Plane, PlaneView> = {
  transaxial: {
    right: [1, 0, 0],
    down: [0, 1, 0],
    through: 2,
    letters: { left: "R", right: "L", top: "A", bottom: "P" },
  },
  coronal: {
    right: [1, 0, 0],
    down: [0, 0, -1],
    through: 1,
    letters: { left: "R", right: "L", top: "H", bottom: "F" },
  },
  sagittal: {
    right: [0, 1, 0],
    down: [0, 0, -1],
    through: 0,
    letters: { left: "A", right: "P", top: "H", bottom: "F" },
  },
};

export interface Box {
  low: Vec3;
  high: Vec3;
}

/** The box, in patient axes, of the voxel centres. */
export function boundsOf(volume: VolumeBody): Box {
  const low: Vec3 = [Infinity, Infinity, Infinity];
  const high: Vec3 = [-Infinity, -Infinity, -Infinity];
  for (let corner = 0; corner < 8; ++corner) {
    let p = volume.origin;
    for (let a = 0; a < 3; ++a) {
      if ((corner >> a) & 1) p = add(p, scale(volume.axes[a]!, (volume.dims[a]! - 1) * volume.spacing[a]!));
    }
    for (let a = 0; a < 3; ++a) {
      low[a] = Math.min(low[a]!, p[a]!);
      high[a] = Math.max(high[a]!, p[a]!);
    }
  }
  return { low, high };
}

/** Voxel coordinates (i, j, k), not rounded, of a patient point. */
export function toVoxel(volume: VolumeBody, patient: Vec3): Vec3 {
  const d = sub(patient, volume.origin);
  return [
    dot(d, volume.axes[0]) / volume.spacing[0],
    dot(d, volume.axes[1]) / volume.spacing[1],
    dot(d, volume.axes[2]) / volume.spacing[2],
  ];
}

/** What lies outside the CT, in HU; drawn as black. */
export const kOutside_HU = -2000;

/** Trilinear HU at voxel coordinates, kOutside_HU beyond the voxel centres. */
export function sampleVoxel(volume: VolumeBody, i: number, j: number, k: number): number {
  const [ni, nj, nk] = volume.dims;
  // The slack is above rounding and far below a voxel, so that the outermost voxels are never lost.
  const e = 1e-6;
  if (!(i >= -e && j >= -e && k >= -e && i <= ni - 1 + e && j <= nj - 1 + e && k <= nk - 1 + e))
    return kOutside_HU;
  const i0 = Math.max(0, Math.min(Math.floor(i), ni - 2));
  const j0 = Math.max(0, Math.min(Math.floor(j), nj - 2));
  const k0 = Math.max(0, Math.min(Math.floor(k), nk - 2));
  const di = ni > 1 ? 1 : 0;
  const dj = nj > 1 ? ni : 0;
  const dk = nk > 1 ? ni * nj : 0;
  const fi = i - i0;
  const fj = j - j0;
  const fk = k - k0;
  const at = i0 + ni * (j0 + nj * k0);
  const hu = volume.hu;
  const c00 = hu[at]! + fi * (hu[at + di]! - hu[at]!);
  const c10 = hu[at + dj]! + fi * (hu[at + dj + di]! - hu[at + dj]!);
  const c01 = hu[at + dk]! + fi * (hu[at + dk + di]! - hu[at + dk]!);
  const c11 = hu[at + dk + dj]! + fi * (hu[at + dk + dj + di]! - hu[at + dk + dj]!);
  const c0 = c00 + fj * (c10 - c00);
  return c0 + fk * (c01 + fj * (c11 - c01) - c0);
}

export function samplePatient(volume: VolumeBody, patient: Vec3): number {
  const [i, j, k] = toVoxel(volume, patient);
  return sampleVoxel(volume, i, j, k);
}

/** A picture of square pixels in patient mm: the same scale across and down, whatever the voxels are. */
export interface SliceGeometry {
  plane: Plane;
  width: number;
  height: number;
  pixel_mm: number;
  /** The patient point of the first pixel's centre. */
  corner: Vec3;
}

/** The slice of `plane` through `point`, over the whole box of the volume or over `reach_mm` around the point. */
export function sliceGeometry(
  volume: VolumeBody,
  plane: Plane,
  point: Vec3,
  reach_mm?: number,
): SliceGeometry {
  const view = kViews[plane];
  const box = reach_mm === undefined ? boundsOf(volume) : around(point, reach_mm);
  const pixel_mm = Math.min(...volume.spacing);
  const extent = (axis: Vec3): number => Math.abs(dot(axis, box.high) - dot(axis, box.low));
  const corner: Vec3 = [0, 0, 0];
  for (const axis of [view.right, view.down]) {
    const a = axis.findIndex((v) => v !== 0);
    corner[a] = axis[a]! > 0 ? box.low[a]! : box.high[a]!;
  }
  corner[view.through] = point[view.through];
  return {
    plane,
    width: Math.floor(extent(view.right) / pixel_mm + 1e-6) + 1,
    height: Math.floor(extent(view.down) / pixel_mm + 1e-6) + 1,
    pixel_mm,
    corner,
  };
}

function around(point: Vec3, reach: number): Box {
  return { low: sub(point, [reach, reach, reach]), high: add(point, [reach, reach, reach]) };
}

export function pixelToPatient(g: SliceGeometry, column: number, row: number): Vec3 {
  const view = kViews[g.plane];
  return add(g.corner, add(scale(view.right, column * g.pixel_mm), scale(view.down, row * g.pixel_mm)));
}
export function patientToPixel(g: SliceGeometry, patient: Vec3): [number, number] {
  const view = kViews[g.plane];
  const d = sub(patient, g.corner);
  return [dot(d, view.right) / g.pixel_mm, dot(d, view.down) / g.pixel_mm];
}

export interface Window {
  width_HU: number;
  level_HU: number;
}
export const kBoneWindow: Window = { width_HU: 2500, level_HU: 480 };

/** Draws the slice as grey RGBA, 4 bytes a pixel, into `out`. */
export function renderSlice(
  volume: VolumeBody,
  g: SliceGeometry,
  window: Window,
  out: Uint8ClampedArray,
): void {
  const view = kViews[g.plane];
  const start = toVoxel(volume, g.corner);
  const across = sub(toVoxel(volume, add(g.corner, scale(view.right, g.pixel_mm))), start);
  const down = sub(toVoxel(volume, add(g.corner, scale(view.down, g.pixel_mm))), start);
  const low = window.level_HU - window.width_HU / 2;
  const gain = 255 / window.width_HU;
  let at = 0;
  for (let row = 0; row < g.height; ++row) {
    let i = start[0] + row * down[0];
    let j = start[1] + row * down[1];
    let k = start[2] + row * down[2];
    for (let column = 0; column < g.width; ++column) {
      const grey = (sampleVoxel(volume, i, j, k) - low) * gain;
      out[at] = grey;
      out[at + 1] = grey;
      out[at + 2] = grey;
      out[at + 3] = 255;
      at += 4;
      i += across[0];
      j += across[1];
      k += across[2];
    }
  }
}
