// A case as the rooms need it, kept while its rooms are open: going from Plan to Drill fetches nothing twice.
import type { MeshBody, Vec3, VolumeBody } from "../contract/bodies";
import type { CaseDetail, PathInfo } from "../contract/rest";
import { boundsOf } from "../geometry/slice";
import { fetchCase, fetchMesh, fetchPath, fetchVolume } from "./api";

export interface CaseData {
  detail: CaseDetail;
  mesh: MeshBody | null;
  volume: VolumeBody | null;
  /** Middle of what is drawn, patient frame. */
  centre: Vec3;
}

let kept: { id: string; bodies: Promise<[MeshBody | null, VolumeBody | null]> } | null = null;

/** @throws ApiError, ContractError. A case that is not reconstructed yet has no mesh. */
export async function loadCase(id: string): Promise<CaseData> {
  const detail = await fetchCase(id);
  if (kept?.id !== id || detail.stage !== "reconstructed") kept = { id, bodies: fetchBodies(detail) };
  try {
    const [mesh, volume] = await kept.bodies;
    return { detail, mesh, volume, centre: centreOf(mesh, volume) };
  } catch (error) {
    kept = null;
    throw error;
  }
}

function fetchBodies(detail: CaseDetail): Promise<[MeshBody | null, VolumeBody | null]> {
  if (detail.stage !== "reconstructed") return Promise.resolve([null, null]);
  return Promise.all([fetchMesh(detail.id), fetchVolume(detail.id)]);
}

function centreOf(mesh: MeshBody | null, volume: VolumeBody | null): Vec3 {
  if (mesh) return mesh.origin;
  if (!volume) return [0, 0, 0];
  const { low, high } = boundsOf(volume);
  return [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2];
}

export function pathOf(detail: CaseDetail, path_id: string | null): PathInfo | null {
  return detail.paths.find((path) => path.id === path_id) ?? null;
}

/** Also one that was changed or deleted since it was drilled: it is no longer listed, but still there. */
export async function pathAsDrilled(detail: CaseDetail, path_id: string): Promise<PathInfo> {
  return pathOf(detail, path_id) ?? (await fetchPath(detail.id, path_id));
}
