// What wheel and keys do to a slice.
import type { Signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Vec3 } from "../contract/bodies";
import { patientToPixel, pixelToPatient, type SliceGeometry } from "../geometry/slice";
import { kWhole, type Zoom, zoomAbout } from "../geometry/zoom";

/** Wheel listeners must be active ones to keep the page from scrolling; JSX makes passive ones. */
export function useWheel(
  target: { current: Element | null },
  act: (event: WheelEvent) => void,
  on: boolean,
): void {
  const latest = useRef(act);
  latest.current = act;
  useEffect(() => {
    const element = target.current;
    if (!element || !on) return;
    const listener = (event: Event): void => {
      event.preventDefault();
      latest.current(event as WheelEvent);
    };
    element.addEventListener("wheel", listener, { passive: false });
    return () => element.removeEventListener("wheel", listener);
  }, [target, on]);
}

/** A notch of the wheel, or a key. */
export const kZoomStep = 1.25;

export function moveByKey(
  event: KeyboardEvent,
  geometry: SliceGeometry,
  point: Signal<Vec3>,
  page: (steps: number) => void,
): boolean {
  const moves: Record<string, [number, number]> = {
    ArrowLeft: [-1, 0],
    ArrowRight: [1, 0],
    ArrowUp: [0, -1],
    ArrowDown: [0, 1],
  };
  if (event.key === "PageUp" || event.key === "PageDown") {
    page(event.key === "PageUp" ? 1 : -1);
    return true;
  }
  const move = moves[event.key];
  if (!move) return false;
  const [column, row] = patientToPixel(geometry, point.value);
  const speed = event.shiftKey ? 1 : 4;
  point.value = pixelToPatient(
    geometry,
    clamp(column + move[0] * speed, 0, geometry.width - 1),
    clamp(row + move[1] * speed, 0, geometry.height - 1),
  );
  return true;
}

/** Plus and minus magnify about the crosshair, 0 shows all again. */
export function zoomByKey(
  event: KeyboardEvent,
  whole: SliceGeometry,
  geometry: SliceGeometry,
  point: Vec3,
  zoom: Signal<Zoom>,
): boolean {
  const times: Record<string, number> = { "+": kZoomStep, "=": kZoomStep, "-": 1 / kZoomStep };
  if (event.key === "0") zoom.value = kWhole;
  const factor = times[event.key];
  if (factor === undefined) return event.key === "0";
  const [column, row] = patientToPixel(geometry, point);
  zoom.value = zoomAbout(
    whole,
    zoom.value,
    factor,
    clamp(column, 0, geometry.width - 1),
    clamp(row, 0, geometry.height - 1),
  );
  return true;
}

export function clamp(v: number, low: number, high: number): number {
  return Math.max(low, Math.min(high, v));
}
