// The true cross-section of a hole or a bit in a slice plane. Both are solids of revolution, convex, so the section is
// the convex hull of where the plane meets their generators and rims.
import type { Vec3 } from "../contract/bodies";
import { add, perpendiculars, scale, sub } from "./vec";

/** Profile points along the axis: distance from `origin` along `axis`, and the radius there. */
export interface Revolution {
  origin: Vec3;
  axis: Vec3;
  profile: { along: number; radius: number }[];
}

/** The planned hole: as wide as the bit, from the entry to the target. */
export function holeSolid(entry: Vec3, axis: Vec3, length: number, diameter: number): Revolution {
  return {
    origin: entry,
    axis,
    profile: [
      { along: 0, radius: diameter / 2 },
      { along: length, radius: diameter / 2 },
    ],
  };
}

/** The bit: apex of the cone at `tip`, axis from shank to tip. */
export function bitSolid(
  tip: Vec3,
  axis: Vec3,
  bit: { diameter_mm: number; cone_length_mm: number; length_mm: number },
): Revolution {
  const radius = bit.diameter_mm / 2;
  return {
    origin: tip,
    axis: scale(axis, -1),
    profile: [
      { along: 0, radius: bit.cone_length_mm > 0 ? 0 : radius },
      { along: bit.cone_length_mm, radius },
      { along: bit.length_mm, radius },
    ],
  };
}

const kGenerators = 48;

/** The polygon, in order, in which the plane {p : p[through] = level} cuts the solid; empty when they do not meet. */
export function sectionOf(solid: Revolution, through: 0 | 1 | 2, level: number): Vec3[] {
  const [u, v] = perpendiculars(solid.axis);
  const rim = (station: { along: number; radius: number }): Vec3[] => {
    const centre = add(solid.origin, scale(solid.axis, station.along));
    return Array.from({ length: kGenerators }, (_, i) => {
      const angle = (2 * Math.PI * i) / kGenerators;
      const radial = add(scale(u, Math.cos(angle)), scale(v, Math.sin(angle)));
      return add(centre, scale(radial, station.radius));
    });
  };
  const rims = solid.profile.map(rim);
  const hits: Vec3[] = [];
  const cut = (a: Vec3, b: Vec3): void => {
    const da = a[through] - level;
    const db = b[through] - level;
    if (da * db < 0) hits.push(add(a, scale(sub(b, a), da / (da - db))));
    else if (da === 0) hits.push(a);
  };
  for (const ring of rims) ring.forEach((p, i) => void cut(p, ring[(i + 1) % kGenerators]!));
  for (let s = 0; s + 1 < rims.length; ++s) rims[s]!.forEach((p, i) => void cut(p, rims[s + 1]![i]!));
  return hull(hits, ((through + 1) % 3) as 0 | 1 | 2, ((through + 2) % 3) as 0 | 1 | 2);
}

/** Andrew's monotone chain, over two of the three coordinates. */
function hull(points: Vec3[], x: 0 | 1 | 2, y: 0 | 1 | 2): Vec3[] {
  if (points.length < 3) return [];
  const sorted = [...points].sort((a, b) => a[x] - b[x] || a[y] - b[y]);
  const turn = (o: Vec3, a: Vec3, b: Vec3): number =>
    (a[x] - o[x]) * (b[y] - o[y]) - (a[y] - o[y]) * (b[x] - o[x]);
  const half = (list: Vec3[]): Vec3[] => {
    const chain: Vec3[] = [];
    for (const p of list) {
      while (chain.length >= 2 && turn(chain[chain.length - 2]!, chain[chain.length - 1]!, p) <= 1e-12)
        chain.pop();
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())];
}
