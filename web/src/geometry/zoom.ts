// A slice magnified about a point of its picture: the same number of pixels over a smaller part of the patient.
import { pixelToPatient, type SliceGeometry } from "./slice";

/** `left` and `top`: where, in pixels of the whole picture, the magnified one's first pixel lies. */
export interface Zoom {
  factor: number;
  left: number;
  top: number;
}

export const kWhole: Zoom = { factor: 1, left: 0, top: 0 };
const kMost = 16;

export function zoomed(whole: SliceGeometry, zoom: Zoom): SliceGeometry {
  if (zoom.factor === 1) return whole;
  return {
    ...whole,
    pixel_mm: whole.pixel_mm / zoom.factor,
    corner: pixelToPatient(whole, zoom.left, zoom.top),
  };
}

/** Magnifies by `times`; what lies at (column, row) of the picture as it is now stays there. */
export function zoomAbout(
  whole: SliceGeometry,
  zoom: Zoom,
  times: number,
  column: number,
  row: number,
): Zoom {
  const factor = Math.max(1, Math.min(kMost, zoom.factor * times));
  return within(whole, {
    factor,
    left: zoom.left + column / zoom.factor - column / factor,
    top: zoom.top + row / zoom.factor - row / factor,
  });
}

/** Moves the magnified part by pixels of the picture as it is now. */
export function panned(whole: SliceGeometry, zoom: Zoom, columns: number, rows: number): Zoom {
  const { factor, left, top } = zoom;
  return within(whole, { factor, left: left - columns / factor, top: top - rows / factor });
}

/** Never shows what lies beside the whole picture. */
function within(whole: SliceGeometry, { factor, left, top }: Zoom): Zoom {
  const held = (at: number, size: number): number => Math.max(0, Math.min(at, (size - 1) * (1 - 1 / factor)));
  return { factor, left: held(left, whole.width), top: held(top, whole.height) };
}
