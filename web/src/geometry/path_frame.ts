// The frame of a path, as core/plan's pathFrame makes it: so that a dragged path is drawn before the server knows of it.
import type { Vec3 } from "../contract/bodies";
import type { PathFrame } from "../contract/rest";
import { cross, dot, normalized, scale, sub } from "./vec";

/** Origin at the entry, z towards the target; x is the patient axis least along z, made perpendicular.
 * @pre entry and target differ. */
export function pathFrame(entry: Vec3, target: Vec3): PathFrame {
  const z = normalized(sub(target, entry));
  const [ax, ay, az] = z.map(Math.abs) as Vec3;
  let least: Vec3 = [1, 0, 0];
  if (ay < ax && ay <= az) least = [0, 1, 0];
  if (az < ax && az < ay) least = [0, 0, 1];
  const x = normalized(sub(least, scale(z, dot(least, z))));
  return { origin_patient: entry, axes: [x, cross(z, x), z] };
}
