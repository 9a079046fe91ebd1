// Window and level: presets on the keys 1 to 5, and the drag with the right button.
import { kBoneWindow, type Window } from "../geometry/slice";

export interface Preset {
  key: string;
  name: string;
  window: Window;
}

export const kPresets: readonly Preset[] = [
  { key: "1", name: "Soft tissue", window: { width_HU: 400, level_HU: 40 } },
  { key: "2", name: "Lung", window: { width_HU: 1500, level_HU: -600 } },
  { key: "3", name: "Liver", window: { width_HU: 150, level_HU: 90 } },
  { key: "4", name: "Bone", window: kBoneWindow },
  { key: "5", name: "Brain", window: { width_HU: 80, level_HU: 40 } },
];

export function presetOfKey(key: string): Preset | null {
  return kPresets.find((preset) => preset.key === key) ?? null;
}
export function isSameWindow(a: Window, b: Window): boolean {
  return a.width_HU === b.width_HU && a.level_HU === b.level_HU;
}

const kWidest_HU = 5000;
const kFarthest_HU = 3000;

/** To the right: wider, less contrast. Down: a higher level, darker. A wide window moves in larger steps. */
export function windowAfterDrag(from: Window, right_px: number, down_px: number): Window {
  const step = Math.max(0.5, from.width_HU / 400);
  return {
    width_HU: Math.round(Math.max(1, Math.min(kWidest_HU, from.width_HU + right_px * step))),
    level_HU: Math.round(Math.max(-kFarthest_HU, Math.min(kFarthest_HU, from.level_HU + down_px * step))),
  };
}
