// What a drill sounds like at a speed, under a load, in bone of a density. Pure; ui/drill_sound.ts plays it.

export interface SoundInput {
  /** 0 when the bit stands still. */
  speed_rpm: number;
  torque_Nmm: number;
  /** Of the bone cut lately, 0 while none is. */
  density_mg_cm3: number;
}

export interface Sound {
  /** Of the motor's whine. */
  pitch_Hz: number;
  /** 0 .. 1. */
  whine: number;
  /** Where the whine is cut off: a loaded motor sounds harsher. */
  cutoff_Hz: number;
  /** How loud bone is cut, 0 .. 1, and how bright that is. */
  grind: number;
  grind_Hz: number;
}

/** Whine over revolutions: the gear of a surgical drill has some tens of teeth. */
const kTeeth = 22;
/** A motor under this torque loses a fifth of its pitch; the speed itself is held. */
const kHeavy_Nmm = 20;
const kCortex_mg_cm3 = 1850;

export function soundOf({ speed_rpm, torque_Nmm, density_mg_cm3 }: SoundInput): Sound {
  const turning = speed_rpm > 0;
  const load = part(torque_Nmm / kHeavy_Nmm);
  const dense = part(density_mg_cm3 / kCortex_mg_cm3);
  const cutting = turning && density_mg_cm3 > 1 ? 1 : 0;
  return {
    pitch_Hz: (speed_rpm / 60) * kTeeth * (1 - 0.2 * load),
    whine: turning ? 0.3 + 0.4 * Math.sqrt(load) : 0,
    cutoff_Hz: 900 + 2600 * load,
    // Loudness goes about with the root of the power that is spent.
    grind: cutting * Math.min(1, 0.08 + 0.9 * Math.sqrt(load)),
    grind_Hz: 500 + 4000 * dense,
  };
}

function part(v: number): number {
  return Number.isFinite(v) ? Math.max(0, Math.min(1, v)) : 0;
}
