// What is drawn over a slice: cross-sections, axes, crosshair, scale bar, measurements.
import type { Vec3 } from "../contract/bodies";
import { sectionOf } from "../geometry/section";
import { kPlanes, kViews, type Plane, patientToPixel, type SliceGeometry } from "../geometry/slice";
import { type Measurement, measureText } from "../state/measure";
import type { SliceLine, SliceMark } from "./slice_marks";

interface OverlayProps {
  geometry: SliceGeometry;
  point: Vec3;
  marks: SliceMark[];
  lines: SliceLine[];
  measured: Measurement[];
  crosshair: boolean;
}

export function Overlay({ geometry, point, marks, lines, measured, crosshair }: OverlayProps) {
  const view = kViews[geometry.plane];
  const level = point[view.through];
  const pixel = pixelIn(geometry);
  const [x, y] = pixel(point);
  const planeOfAxis = (axis: Vec3): Plane =>
    kPlanes.find((plane) => kViews[plane].through === axis.findIndex((v) => v !== 0))!;
  const bar = 10 / geometry.pixel_mm;
  return (
    <>
      {lines.map((line, i) => {
        const [x1, y1] = pixel(line.from);
        const [x2, y2] = pixel(line.to);
        return <line key={i} class={`mark-line mark-line-${line.kind}`} x1={x1} y1={y1} x2={x2} y2={y2} />;
      })}
      {marks.map((mark, i) => {
        const polygon = sectionOf(mark.solid, view.through, level).map(pixel);
        if (polygon.length < 3) return null;
        return (
          <polygon
            key={i}
            class={`mark mark-${mark.kind}`}
            points={polygon.map((p) => p.join(",")).join(" ")}
          />
        );
      })}
      {crosshair && (
        <>
          <line class={`cross cross-${planeOfAxis(view.right)}`} x1={x} x2={x} y1={0} y2={geometry.height} />
          <line class={`cross cross-${planeOfAxis(view.down)}`} x1={0} x2={geometry.width} y1={y} y2={y} />
        </>
      )}
      {measured.map((one, i) => (
        <polyline
          key={`m${i}`}
          class="measured"
          points={one.points.map((p) => pixel(p).join(",")).join(" ")}
        />
      ))}
      <line
        class="scale-bar"
        x1={geometry.width - bar - 6}
        x2={geometry.width - 6}
        y1={geometry.height - 8}
        y2={geometry.height - 8}
      />
    </>
  );
}

/** Numbers beside what was measured, in the frame of the picture. */
export function MeasureTexts({ geometry, measured }: { geometry: SliceGeometry; measured: Measurement[] }) {
  const pixel = pixelIn(geometry);
  return (
    <>
      {measured.map((one, i) => {
        const text = measureText(one);
        const [x, y] = pixel(one.kind === "angle" ? one.points[1]! : one.points[one.points.length - 1]!);
        if (text === "") return null;
        return (
          <output
            key={i}
            class="measure-text"
            style={{ left: `${(100 * x) / geometry.width}%`, top: `${(100 * y) / geometry.height}%` }}
          >
            {text}
          </output>
        );
      })}
    </>
  );
}

function pixelIn(geometry: SliceGeometry): (p: Vec3) => [number, number] {
  return (p) => {
    const [x, y] = patientToPixel(geometry, p);
    return [x + 0.5, y + 0.5];
  };
}
