// The core in WebAssembly, as wasm/ binds it (see wasm/README.md). Bindings throw Errors with one line.

import type { Vec3 } from "../contract/bodies";

export interface StepOutput {
  status: number;
  cycle: number;
  removed: number;
  removed_total: number;
  thrust_N: number;
  depth_mm: number;
  /** The motion up to here is not all cut yet. */
  behind: boolean;
  /** Where the bit is, which need not be where the hand is. */
  tip: Vec3;
  axis: Vec3;
  /** On the hand, in the bit's own frame: z is minus the thrust, and minus the cutting torque. */
  force_N: Vec3;
  torque_Nmm: Vec3;
  /** The same force in the path frame. */
  hand_force_N: Vec3;
  /** Mean of what this step removed; 0 when it removed nothing. */
  density_mg_cm3: number;
}

/** Holds the drill: a mass and a damper that push along it, and across it a spring to an aim. */
export interface CoreHand {
  place(at: Vec3): void;
  step(seconds: number, axis: Vec3, push_N: number, aim: Vec3, reaction_N: Vec3): void;
  at(): Vec3;
  /** mm/s. */
  velocity(): Vec3;
  delete(): void;
}

/** Seven floats a splat: x, y, z (path frame, mm), nx, ny, nz, kind (0 outer surface, 1 wall of the cut). */
export const kSplatFloats = 7;

export interface CoreSession {
  step(
    t_us: number,
    tx: number,
    ty: number,
    tz: number,
    ax: number,
    ay: number,
    az: number,
    spinning: boolean,
  ): StepOutput;
  stateHash(): string;
  points(): number;
  /** Bit (index & 31) of word (index >> 5). */
  aliveBits(): Uint32Array;
  takeSplats(): Float32Array;
  takeSplatIndices(): Uint32Array;
  takeHidden(): Uint32Array;
  recordingBytes(): Uint8Array;
  metricsJson(): string;
  delete(): void;
}

export interface PlayerPose {
  t_us: number;
  tip: [number, number, number];
  axis: [number, number, number];
  thrust_N: number;
  depth_mm: number;
  removed_total: number;
}

export interface Verdict {
  verified: boolean;
  cycles: number;
  hash: string;
  first_difference: number;
  /** Of the point volume, counted from 0. */
  discs: number[];
  /** False: recorded before version 0.2, which hashed states otherwise. */
  comparable: boolean;
  /** All of that in a line, for people. */
  finding: string;
}

export interface CorePlayer {
  cycles(): number;
  headerJson(): string;
  seek(cycle: number): void;
  /** Undefined when nothing was recorded. */
  poseAt(cycle: number): PlayerPose | undefined;
  /** Rows of t_s, depth_mm, thrust_N, removed_mm3: of cycle 1, every `stride`-th after it, and the last. */
  series(stride: number): Float32Array;
  splats(): Float32Array;
  aliveBits(): Uint32Array;
  verify(): Verdict;
  delete(): void;
}

export interface SceneResult {
  hash: string;
  removed: number;
  cycles: number;
}

export interface Core {
  Session: new (point_volume: Uint8Array, config_json: string) => CoreSession;
  Hand: new (mass_kg: number, damping_N_s_mm: number, across_N_mm: number) => CoreHand;
  Player: new (recording: Uint8Array) => CorePlayer;
  runScene(name: string, engine: string, cycles: number, discs: number): SceneResult;
}
