// The core in WebAssembly, as wasm/ binds it (see wasm/README.md). Bindings throw Errors with one line.

export interface StepOutput {
  status: number;
  cycle: number;
  removed: number;
  removed_total: number;
  thrust_N: number;
  depth_mm: number;
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
  Player: new (recording: Uint8Array) => CorePlayer;
  runScene(name: string, engine: string, cycles: number, discs: number): SceneResult;
}
