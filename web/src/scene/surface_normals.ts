// The mesh's smooth normals, asked for at any place near it. The points along the path know their own normals only to
// some degrees (they see a few neighbours); the mesh knows the implicit surface's. Pure.
import type { MeshBody, Vec3 } from "../contract/bodies";
import type { PathFrame } from "../contract/rest";
import { directionToLocal, toLocal } from "../geometry/vec";

/** Vertices count up to this far away, the near ones most. */
const kReach_mm = 1.2;

export class SurfaceNormals {
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
  at(x: number, y: number, z: number): Vec3 | null {
    const [i, j, k] = cellOf(x, y, z);
    const sum: Vec3 = [0, 0, 0];
    for (let di = -1; di <= 1; ++di) {
      for (let dj = -1; dj <= 1; ++dj) {
        for (let dk = -1; dk <= 1; ++dk)
          addCell(this.cells.get([i + di, j + dj, k + dk].join()), x, y, z, sum);
      }
    }
    const size = Math.hypot(...sum);
    return size < 1e-9 ? null : [sum[0] / size, sum[1] / size, sum[2] / size];
  }
}

function cellOf(x: number, y: number, z: number): Vec3 {
  return [Math.floor(x / kReach_mm), Math.floor(y / kReach_mm), Math.floor(z / kReach_mm)];
}

function addCell(cell: number[] | undefined, x: number, y: number, z: number, sum: Vec3): void {
  if (!cell) return;
  for (let at = 0; at < cell.length; at += 6) {
    const d2 = (cell[at]! - x) ** 2 + (cell[at + 1]! - y) ** 2 + (cell[at + 2]! - z) ** 2;
    if (d2 >= kReach_mm ** 2) continue;
    const weight = (1 - d2 / kReach_mm ** 2) ** 4 / (d2 + 0.02);
    for (let a = 0; a < 3; ++a) sum[a] = sum[a]! + weight * cell[at + 3 + a]!;
  }
}
