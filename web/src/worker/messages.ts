// What the page and the core's worker say to each other.
import type { PlayerPose, SceneResult, Verdict } from "./core_api";
import type { Readings } from "./drill_loop";
import type { Steering } from "./motion";
import type { Agreement } from "./server_link";

export interface OpenDrill {
  type: "open_drill";
  point_volume: Uint8Array;
  config_json: string;
  /** Of the coupling between hand and bit, as in the config. */
  stiffness_N_mm: number;
  lead_mm: number;
  reach_mm: number;
  /** Where the server's session listens; null to drill here alone. */
  socket_url: string | null;
  offline_reason: string;
}

export type ToWorker =
  | OpenDrill
  | { type: "steer"; steering: Steering }
  /** Moves the aim across the drill, mm. */
  | { type: "nudge"; across: [number, number] }
  | { type: "wheel"; push_N: number }
  | { type: "watch_alive"; on: boolean }
  /** The last frame has been drawn: the next may come. A page that draws slowly is never flooded. */
  | { type: "shown" }
  | { type: "finish_drill" }
  /** After it: waits no longer for the server. */
  | { type: "finish_alone" }
  | { type: "open_replay"; recording: Uint8Array; verify_only: boolean }
  | { type: "seek"; cycle: number }
  | { type: "run_scene"; name: string; engine: string; cycles: number; discs: number };

/** Changes of what is exposed: rows of kSplatFloats and the lattice index of each, and the indices that went. */
export interface SplatChange {
  rows: Float32Array;
  indices: Uint32Array;
  hidden: Uint32Array;
}

export type FromWorker =
  | { type: "drill_open"; points: number }
  | { type: "frame"; readings: Readings; splats: SplatChange; trace: Float32Array }
  | { type: "alive"; alive: Uint32Array }
  | { type: "agreement"; agreement: Agreement }
  | {
      type: "drill_finished";
      recording_id: string | null;
      metrics_json: string | null;
      /** Where the server has not kept one. */
      recording: Uint8Array | null;
    }
  | { type: "replay_open"; cycles: number; header_json: string; series: Float32Array; stride: number }
  | { type: "moment"; cycle: number; pose: PlayerPose; splats: Float32Array; alive: Uint32Array }
  | { type: "verdict"; verdict: Verdict }
  | { type: "scene"; result: SceneResult }
  | { type: "failed"; message: string };
