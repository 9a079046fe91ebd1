// What the paths and the bit leave in the slices: true cross-sections, and the paths' axes.
import type { Vec3 } from "../contract/bodies";
import type { DrawnPath } from "../contract/rest";
import { bitSolid, holeSolid, type Revolution } from "../geometry/section";
import { add, scale } from "../geometry/vec";

export interface SliceMark {
  kind: "hole" | "bit" | "other";
  solid: Revolution;
}

/** A line through the picture, e.g. the path's axis. */
export interface SliceLine {
  kind: "path" | "other";
  from: Vec3;
  to: Vec3;
}

export function sliceMarks(
  paths: DrawnPath[],
  chosen: DrawnPath | null,
  bit: { tip: Vec3; axis: Vec3 } | null,
): { marks: SliceMark[]; lines: SliceLine[] } {
  const marks: SliceMark[] = [];
  const lines: SliceLine[] = [];
  for (const path of paths) {
    const z = path.frame.axes[2];
    const mine = path.id === chosen?.id;
    const solid = holeSolid(path.entry_patient, z, path.length_mm, path.bit.diameter_mm);
    marks.push({ kind: mine ? "hole" : "other", solid });
    lines.push({
      kind: mine ? "path" : "other",
      from: add(path.entry_patient, scale(z, -18)),
      to: path.target_patient,
    });
  }
  if (bit && chosen) marks.push({ kind: "bit", solid: bitSolid(bit.tip, bit.axis, chosen.bit) });
  return { marks, lines };
}
