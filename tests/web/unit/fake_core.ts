// Stand-ins for the compiled core: a bone along the path, and the hand as core/haptics/hand.h says it.
import type { Vec3 } from "@web/contract/bodies";
import { add, dot, scale, sub } from "@web/geometry/vec";
import type { CoreHand, CoreSession, StepOutput } from "@web/worker/core_api";

/**
 * The bit follows the hand's z through a spring of 5 N/mm; bone lets it advance by what the pull is above `hard(z)` N.
 * Its hash is the count of cycles.
 */
export class FakeSession implements CoreSession {
  steps: number[][] = [];
  private bit_z: number | null = null;
  constructor(private readonly hard: (z: number) => number = () => 0) {}

  step(...input: [number, number, number, number, number, number, number, boolean]): StepOutput {
    this.steps.push(input.slice(0, 7) as number[]);
    const [, x, y, z, ax, ay, az] = input;
    this.bit_z ??= z;
    const resists = this.hard(this.bit_z);
    const pull_N = 5 * (z - this.bit_z);
    const advance = resists === 0 ? z - this.bit_z : Math.max(0, (pull_N - resists) / resists) * 0.01;
    this.bit_z += resists > 0 && pull_N < 0 ? z - this.bit_z : advance;
    const thrust_N = 5 * (z - this.bit_z);
    return {
      status: 0,
      cycle: this.steps.length,
      removed: 0,
      removed_total: 0,
      thrust_N,
      depth_mm: this.bit_z,
      behind: false,
      tip: [x, y, this.bit_z],
      axis: [ax, ay, az],
      force_N: [0, 0, -thrust_N],
      torque_Nmm: [0, 0, 0],
      hand_force_N: [0, 0, -thrust_N],
      density_mg_cm3: resists > 0 && advance > 0 ? 100 * resists : 0,
    };
  }
  stateHash = () => String(this.steps.length).padStart(16, "0");
  points = () => 0;
  aliveBits = () => new Uint32Array();
  takeSplats = () => new Float32Array();
  takeSplatIndices = () => new Uint32Array();
  takeHidden = () => new Uint32Array();
  recordingBytes = () => new Uint8Array();
  metricsJson = () => "{}";
  delete(): void {}
}

export class FakeHand implements CoreHand {
  private where: Vec3 = [0, 0, 0];
  private moves: Vec3 = [0, 0, 0];
  private readonly mass_kg = 0.25;
  private readonly damping = 0.1;
  private readonly across = 2;

  place(at: Vec3): void {
    this.where = at;
    this.moves = [0, 0, 0];
  }
  step(seconds: number, axis: Vec3, push_N: number, aim: Vec3, reaction_N: Vec3): void {
    const per_kg = 1000 / this.mass_kg;
    const off = sub(aim, this.where);
    const across = sub(off, scale(axis, dot(off, axis)));
    const force = add(add(scale(axis, push_N), reaction_N), scale(across, this.across));
    const brake = 1 + (this.damping + this.across * seconds) * per_kg * seconds;
    this.moves = scale(add(this.moves, scale(force, per_kg * seconds)), 1 / brake);
    this.where = add(this.where, scale(this.moves, seconds));
  }
  at = (): Vec3 => this.where;
  velocity = (): Vec3 => this.moves;
  delete(): void {}
}
