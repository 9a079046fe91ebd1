// What a hole is planned with: the bit or screw as parameters, and some that are common.
//
// Lumbar and thoracic pedicle screws come in 4.5 to 7.5 mm by 30 to 55 mm; the diameter is taken at about 80 % of the pedicle's
// width (review: Solitro et al., Int J Spine Surg 2019, 13(2):132). A pilot hole of half the screw's diameter held best in
// Lee & Schmidt (Spinal News International, "Probing, tapping, toggling"), which gives the drills here. 3.0 mm with a 5 mm
// cone is the bit of the report that this program began with (core/plan/path.h).
import type { BitInfo } from "../contract/rest";

export const kDiameter_mm = { low: 2.5, high: 8, step: 0.1 };
export const kLength_mm = { low: 20, high: 60, step: 1 };

export interface CommonBit {
  name: string;
  diameter_mm: number;
  length_mm: number;
}

export const kCommonBits: readonly CommonBit[] = [
  { name: "Drill 2.7 mm, for a 5.5 mm screw", diameter_mm: 2.7, length_mm: 50 },
  { name: "Drill 3.0 mm", diameter_mm: 3, length_mm: 50 },
  { name: "Drill 3.2 mm, for a 6.5 mm screw", diameter_mm: 3.2, length_mm: 50 },
  { name: "Drill 3.7 mm, for a 7.5 mm screw", diameter_mm: 3.7, length_mm: 50 },
  { name: "Screw 4.5 × 35 mm", diameter_mm: 4.5, length_mm: 35 },
  { name: "Screw 5.5 × 40 mm", diameter_mm: 5.5, length_mm: 40 },
  { name: "Screw 6.5 × 45 mm", diameter_mm: 6.5, length_mm: 45 },
  { name: "Screw 7.5 × 50 mm", diameter_mm: 7.5, length_mm: 50 },
];

export function commonBitOf(bit: BitInfo): CommonBit | null {
  return (
    kCommonBits.find((one) => one.diameter_mm === bit.diameter_mm && one.length_mm === bit.length_mm) ?? null
  );
}

/** Kept within the limits; the cone stays as it is. */
export function bitWith(bit: BitInfo, change: Partial<Pick<BitInfo, "diameter_mm" | "length_mm">>): BitInfo {
  const clamp = (v: number, { low, high }: { low: number; high: number }): number =>
    Number.isFinite(v) ? Math.max(low, Math.min(high, v)) : low;
  return {
    ...bit,
    diameter_mm: clamp(change.diameter_mm ?? bit.diameter_mm, kDiameter_mm),
    length_mm: clamp(change.length_mm ?? bit.length_mm, kLength_mm),
  };
}

/** Of bone that is modelled around a hole: at least a millimetre beyond the bit. */
export function volumeRadiusFor(bit: BitInfo, radius_mm: number): number {
  return Math.max(radius_mm, bit.diameter_mm / 2 + 1);
}
