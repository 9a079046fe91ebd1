// Lengths and angles measured in a slice. Pure: points are in patient mm, so what is measured does not depend on the zoom.
import type { Vec3 } from "../contract/bodies";
import { kViews, type Plane } from "../geometry/slice";
import { dot, norm, sub } from "../geometry/vec";

export type Measure = "length" | "angle";
export type Tool = "crosshair" | Measure;

/** Two points, or three with the corner in the middle. */
export interface Measurement {
  kind: Measure;
  plane: Plane;
  points: readonly Vec3[];
}

export interface Measuring {
  tool: Tool;
  done: readonly Measurement[];
  /** Points set so far, the first one at least. */
  open: Measurement | null;
}

export const kNotMeasuring: Measuring = { tool: "crosshair", done: [], open: null };
const kPoints: Record<Measure, number> = { length: 2, angle: 3 };

/** Choosing the tool that is in hand puts it away. */
export function withTool(measuring: Measuring, tool: Tool): Measuring {
  return { ...measuring, tool: measuring.tool === tool ? "crosshair" : tool, open: null };
}

/** Sets a point; a measurement that was begun in another plane is dropped. */
export function withPoint(measuring: Measuring, plane: Plane, point: Vec3): Measuring {
  const { tool, done, open } = measuring;
  if (tool === "crosshair") return measuring;
  const before = open?.plane === plane && open.kind === tool ? open.points : [];
  const next: Measurement = { kind: tool, plane, points: [...before, point] };
  if (next.points.length < kPoints[tool]) return { tool, done, open: next };
  return { tool, done: [...done, next], open: null };
}

/** Escape: first what is begun, then all that is measured and the tool. */
export function escaped(measuring: Measuring): Measuring {
  return measuring.open ? { ...measuring, open: null } : kNotMeasuring;
}

/** Those in this plane, not more than `slack_mm` from its level; the open one with its last point at `hover`. */
export function shownIn(
  { done, open }: Measuring,
  plane: Plane,
  level: number,
  slack_mm: number,
  hover: Vec3 | null,
): Measurement[] {
  const through = kViews[plane].through;
  const near = (one: Measurement): boolean =>
    one.plane === plane && one.points.every((p) => Math.abs(p[through] - level) <= slack_mm);
  const growing = open && hover ? [{ ...open, points: [...open.points, hover] }] : open ? [open] : [];
  return [...done, ...growing].filter(near);
}

/** "12.3 mm", "45.0°"; empty while points are missing. */
export function measureText({ kind, points }: Measurement): string {
  const [a, b, c] = points;
  if (!a || !b) return "";
  if (kind === "length") return `${norm(sub(b, a)).toFixed(1)} mm`;
  if (!c) return "";
  const u = sub(a, b);
  const v = sub(c, b);
  const size = norm(u) * norm(v);
  if (size === 0) return "";
  const cosine = Math.max(-1, Math.min(1, dot(u, v) / size));
  return `${((Math.acos(cosine) * 180) / Math.PI).toFixed(1)}°`;
}
