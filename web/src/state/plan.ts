// The plan of a case as it is edited: paths, and what can be done to them. Pure: every edit gives a new plan.
import type { Vec3 } from "../contract/bodies";
import type { BitInfo, DrawnPath, NewPath, PathInfo } from "../contract/rest";
import { pathFrame } from "../geometry/path_frame";
import { add, norm, sub } from "../geometry/vec";
import { volumeRadiusFor } from "./bits";

export type End = "entry" | "target";
export const kEnds: readonly End[] = ["entry", "target"];

/** `key` names it in this page, whatever id the server gives. */
export interface PlannedPath extends NewPath {
  key: string;
}
export type Plan = readonly PlannedPath[];

/** No path is shorter: entry and target stay apart, and each can still be grasped. */
export const kShortest_mm = 2;

export function plannedFrom(path: PathInfo): PlannedPath {
  return { key: path.id, ...definitionOf(path) };
}

/** Always in this order, so that equal definitions are equal as text too. */
export function definitionOf(path: NewPath): NewPath {
  const { label, entry_patient, target_patient, bit, volume_radius_mm, lead_mm, spacing_mm } = path;
  const { diameter_mm, cone_length_mm, length_mm } = bit;
  return {
    label,
    entry_patient,
    target_patient,
    bit: { diameter_mm, cone_length_mm, length_mm },
    volume_radius_mm,
    lead_mm,
    spacing_mm,
  };
}

export function drawnFrom(path: PlannedPath): DrawnPath {
  const { key, label, entry_patient, target_patient, bit } = path;
  return {
    id: key,
    label,
    entry_patient,
    target_patient,
    bit,
    length_mm: lengthOf(path),
    frame: pathFrame(entry_patient, target_patient),
  };
}

export function lengthOf(path: NewPath): number {
  return norm(sub(path.target_patient, path.entry_patient));
}
export function endOf(path: NewPath, end: End): Vec3 {
  return end === "entry" ? path.entry_patient : path.target_patient;
}

function changed(plan: Plan, key: string, change: (path: PlannedPath) => Partial<NewPath>): Plan {
  return plan.map((path) => (path.key === key ? { ...path, ...change(path) } : path));
}

/** Unchanged when the ends would come closer than kShortest_mm. */
export function withEnd(plan: Plan, key: string, end: End, to: Vec3): Plan {
  return changed(plan, key, (path) => {
    const moved = end === "entry" ? { entry_patient: to } : { target_patient: to };
    return lengthOf({ ...path, ...moved }) < kShortest_mm ? {} : moved;
  });
}

export function withBit(plan: Plan, key: string, bit: BitInfo): Plan {
  return changed(plan, key, (path) => ({
    bit,
    volume_radius_mm: volumeRadiusFor(bit, path.volume_radius_mm),
  }));
}

export function withLabel(plan: Plan, key: string, label: string): Plan {
  return changed(plan, key, () => ({ label }));
}

export function without(plan: Plan, key: string): Plan {
  return plan.filter((path) => path.key !== key);
}

/** Server's defaults: core/plan/path.h, server/jobs/plan_job.h. */
const kNew = { volume_radius_mm: 4, lead_mm: 4, spacing_mm: 0.1 };
const kNewBit: BitInfo = { diameter_mm: 3, cone_length_mm: 5, length_mm: 50 };
const kNewLength_mm = 30;

/** From `entry` straight to the front, with the bit of `like` when there is one. */
export function newPath(plan: Plan, key: string, entry: Vec3, like: PlannedPath | null): PlannedPath {
  return {
    ...kNew,
    bit: like?.bit ?? kNewBit,
    volume_radius_mm: like?.volume_radius_mm ?? kNew.volume_radius_mm,
    key,
    label: freeLabel(plan, "Path"),
    entry_patient: entry,
    target_patient: add(entry, [0, -kNewLength_mm, 0]),
  };
}

/** On the other side of the sagittal plane x = middle. */
export function mirrored(plan: Plan, key: string, path: PlannedPath, middle_x: number): PlannedPath {
  const across = ([x, y, z]: Vec3): Vec3 => [2 * middle_x - x, y, z];
  const swapped = path.label.replace(/left|right/gi, (side) => {
    const other = side.toLowerCase() === "left" ? "right" : "left";
    return side[0] === side[0]!.toUpperCase() ? other[0]!.toUpperCase() + other.slice(1) : other;
  });
  const label = swapped === path.label ? `${path.label} mirrored` : swapped;
  return {
    ...path,
    key,
    label: plan.some((one) => one.label === label) ? freeLabel(plan, label) : label,
    entry_patient: across(path.entry_patient),
    target_patient: across(path.target_patient),
  };
}

function freeLabel(plan: Plan, stem: string): string {
  for (let n = plan.length + 1; ; ++n) {
    const label = `${stem} ${n}`;
    if (!plan.some((path) => path.label === label)) return label;
  }
}
