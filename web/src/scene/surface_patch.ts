// The mesh along the path as a smooth surface that can be asked at any place near it. Points of the lattice lie up to a
// spacing beneath the bone's surface and know its normal only to some degrees; the mesh knows where it really is.
// After: the moving least squares of points with normals, e.g. C. Shen et al., "Interpolating and Approximating Implicit
// Surfaces from Polygon Soup", SIGGRAPH 2004 (the constant-normal form, weights by distance). Pure.
import type { MeshBody, Vec3 } from "../contract/bodies";
import type { PathFrame } from "../contract/rest";
import { directionToLocal, toLocal } from "../geometry/vec";

/** Vertices count up to this far away, the near ones most. */
const kReach_mm = 1.2;

export interface SurfacePoint {
  /** Unit, outward. */
  normal: Vec3;
  /** How far the asked place lies outside the surface; negative inside. */
  distance_mm: number;
}

export class SurfacePatch {
  /** Six numbers a vertex, path frame: position, normal. */
  private readonly cells = new Map<string, number[]>();

  /** Takes in the vertices within `radius_mm` of the path's axis. */
  constructor(mesh: MeshBody, frame: PathFrame, radius_mm: number) {
    const limit = (radius_mm + kReach_mm) ** 2;
    for (let v = 0; v < mesh.positions.length; v += 3) {
      const patient: Vec3 = [0, 1, 2].map((a) => mesh.positions[v + a]! + mesh.origin[a]!) as Vec3;
      const p = toLocal(frame, patient);
      if (p[0] * p[0] + p[1] * p[1] > limit) continue;
      const n = directionToLocal(frame, [mesh.normals[v]!, mesh.normals[v + 1]!, mesh.normals[v + 2]!]);
      const key = cellOf(p[0], p[1], p[2]).join();
      const cell = this.cells.get(key);
      if (cell) cell.push(...p, ...n);
      else this.cells.set(key, [...p, ...n]);
    }
  }

  /** Path frame; null when no vertex is near. */
  at(x: number, y: number, z: number): SurfacePoint | null {
    const [i, j, k] = cellOf(x, y, z);
    const sum: Sum = { normal: [0, 0, 0], distance: 0, weight: 0 };
    for (let di = -1; di <= 1; ++di) {
      for (let dj = -1; dj <= 1; ++dj) {
        for (let dk = -1; dk <= 1; ++dk)
          addCell(this.cells.get([i + di, j + dj, k + dk].join()), x, y, z, sum);
      }
    }
    const size = Math.hypot(...sum.normal);
    if (size < 1e-9) return null;
    const normal = sum.normal.map((v) => v / size) as Vec3;
    return { normal, distance_mm: sum.distance / sum.weight };
  }
}

interface Sum {
  normal: Vec3;
  distance: number;
  weight: number;
}

function cellOf(x: number, y: number, z: number): Vec3 {
  return [Math.floor(x / kReach_mm), Math.floor(y / kReach_mm), Math.floor(z / kReach_mm)];
}

function addCell(cell: number[] | undefined, x: number, y: number, z: number, sum: Sum): void {
  if (!cell) return;
  for (let at = 0; at < cell.length; at += 6) {
    const dx = x - cell[at]!;
    const dy = y - cell[at + 1]!;
    const dz = z - cell[at + 2]!;
    const d2 = dx * dx + dy * dy + dz * dz;
    if (d2 >= kReach_mm ** 2) continue;
    const weight = (1 - d2 / kReach_mm ** 2) ** 4 / (d2 + 0.02);
    sum.weight += weight;
    sum.distance += weight * (dx * cell[at + 3]! + dy * cell[at + 4]! + dz * cell[at + 5]!);
    for (let a = 0; a < 3; ++a) sum.normal[a] = sum.normal[a]! + weight * cell[at + 3 + a]!;
  }
}
