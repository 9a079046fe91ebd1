// Loads the built module, and makes what the tests drill.
import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const root = join(dirname(fileURLToPath(import.meta.url)), "..", "..");
const built = process.env.SPINALTAP_WASM ?? join(root, "build", "wasm", "bin");
export const scenesFile = process.env.SPINALTAP_SCENES ?? join(root, "tests", "scenes", "golden", "scenes.csv");

export async function loadCore() {
  const { default: create } = await import(pathToFileURL(join(built, "spinaltap_core.mjs")).href);
  return create({ wasmBinary: readFileSync(join(built, "spinaltap_core.wasm")) });
}

/** A point volume as the bytes of an 'STP1' (server/contract/haptics.md); `density` is a number or a function of the disc, 0: no bone. */
export function pointVolume({ spacing = 0.1, rings = 12, discs = 30, firstDisc = -2, density = 300 } = {}) {
  const points = discs * (3 * rings * (rings - 1) + 1);
  const words = Math.ceil(points / 64);
  const bytes = new Uint8Array(36 + 8 * words + 2 * points);
  const view = new DataView(bytes.buffer);
  bytes.set([0x53, 0x54, 0x50, 0x31, 1]);
  view.setFloat64(8, spacing, true);
  view.setInt32(16, rings, true);
  view.setInt32(20, discs, true);
  view.setInt32(24, firstDisc, true);
  view.setBigUint64(28, BigInt(words), true);
  const densityOf = typeof density === "function" ? density : () => density;
  for (let p = 0; p < points; ++p) {
    const here = densityOf(Math.floor((p * discs) / points));
    if (here > 0) bytes[36 + (p >> 3)] |= 1 << (p & 7);
    view.setUint16(36 + 8 * words + 2 * p, here, true);
  }
  return { bytes, points };
}

export const config = JSON.stringify({
  bit: { diameter_mm: 1.2, cone_length_mm: 0.8, length_mm: 10 },
  case_id: "c7k2m9xq",
  path_id: "p1",
  length_mm: 2.5,
});

/** Poses that go in, wander and tilt; one in 25 is refused. */
export function poses(count) {
  return Array.from({ length: count }, (_, i) => {
    const refused = i % 25 === 24;
    const z = -0.3 + (2.5 * i) / count;
    return [1000 * i, 0.1 * Math.sin(i / 9), 0.1 * Math.cos(i / 7), refused ? NaN : z, 0.05 * Math.sin(i / 40), 0, 1, true];
  });
}
