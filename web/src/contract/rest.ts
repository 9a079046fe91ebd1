// What the server answers under /api/v1, as server/contract/openapi.json says it. Lengths in mm, patient frame (LPS).
import type { Lattice, Vec3 } from "./bodies";

export interface CaseSummary {
  id: string;
  label: string;
  created: string;
  stage: "imported" | "segmented" | "reconstructed";
  paths: number;
  recordings: number;
}

export interface BitInfo {
  diameter_mm: number;
  cone_length_mm: number;
  length_mm: number;
}

export interface PathFrame {
  origin_patient: Vec3;
  /** The x, y and z axes of the path frame, in patient coordinates. */
  axes: [Vec3, Vec3, Vec3];
}

export interface PathInfo {
  id: string;
  label: string;
  entry_patient: Vec3;
  target_patient: Vec3;
  bit: BitInfo;
  volume_radius_mm: number;
  lead_mm: number;
  spacing_mm: number;
  length_mm: number;
  frame: PathFrame;
  lattice: Lattice;
  points: number;
  points_alive: number;
  /** No longer in the plan: replaced or deleted since it was drilled. */
  retired: boolean;
  /** The id in its place; empty when there is none. */
  replaced_by: string;
}

/** What a picture needs of a path, planned or only being planned. */
export type DrawnPath = Pick<
  PathInfo,
  "id" | "label" | "entry_patient" | "target_patient" | "bit" | "length_mm" | "frame"
>;

/** What the server is asked to plan. */
export type NewPath = Pick<
  PathInfo,
  "label" | "entry_patient" | "target_patient" | "bit" | "volume_radius_mm" | "lead_mm" | "spacing_mm"
>;

export type Metrics = Record<string, unknown>;

export interface RecordingInfo {
  id: string;
  case_id: string;
  path_id: string;
  created: string;
  cycles: number;
  complete: boolean;
  metrics: Metrics | null;
}

export interface CaseDetail {
  id: string;
  label: string;
  created: string;
  stage: CaseSummary["stage"];
  figures: Record<string, unknown> | null;
  paths: PathInfo[];
  recordings: RecordingInfo[];
}

export interface SessionInfo {
  id: string;
  engine: string;
  config: unknown;
}

/** RFC 9457. */
export interface Problem {
  title?: string;
  detail?: string;
  status?: number;
}
