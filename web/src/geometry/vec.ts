// Three numbers, and a rigid frame in the patient's space.
import type { Vec3 } from "../contract/bodies";
import type { PathFrame } from "../contract/rest";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a: Vec3, s: number): Vec3 => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const norm = (a: Vec3): number => Math.sqrt(dot(a, a));
export const normalized = (a: Vec3): Vec3 => scale(a, 1 / norm(a));
export const mix = (a: Vec3, b: Vec3, t: number): Vec3 => add(scale(a, 1 - t), scale(b, t));

/** Two unit vectors that make a right-handed base with the unit vector w. */
export function perpendiculars(w: Vec3): [Vec3, Vec3] {
  const least = w.map(Math.abs).indexOf(Math.min(...w.map(Math.abs)));
  const helper: Vec3 = [0, 0, 0];
  helper[least] = 1;
  const u = normalized(sub(helper, scale(w, dot(helper, w))));
  return [u, cross(w, u)];
}

export function toPatient(frame: PathFrame, local: Vec3): Vec3 {
  return add(frame.origin_patient, directionToPatient(frame, local));
}
export function directionToPatient(frame: PathFrame, local: Vec3): Vec3 {
  const [x, y, z] = frame.axes;
  return add(add(scale(x, local[0]), scale(y, local[1])), scale(z, local[2]));
}
export function toLocal(frame: PathFrame, patient: Vec3): Vec3 {
  return directionToLocal(frame, sub(patient, frame.origin_patient));
}
export function directionToLocal(frame: PathFrame, patient: Vec3): Vec3 {
  return [dot(frame.axes[0], patient), dot(frame.axes[1], patient), dot(frame.axes[2], patient)];
}
