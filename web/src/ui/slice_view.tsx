// One slice of the CT, through the one patient point that all views share.
import { type Signal, useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Vec3, VolumeBody } from "../contract/bodies";
import type { Revolution } from "../geometry/section";
import { sectionOf } from "../geometry/section";
import {
  boundsOf,
  kPlanes,
  kViews,
  type Plane,
  patientToPixel,
  pixelToPatient,
  renderSlice,
  type SliceGeometry,
  samplePatient,
  sliceGeometry,
  type Window,
} from "../geometry/slice";
import { dot } from "../geometry/vec";

export interface SliceMark {
  kind: "hole" | "bit" | "other";
  solid: Revolution;
}

/** A line through the picture, e.g. the path's axis. */
export interface SliceLine {
  kind: "path" | "other";
  from: Vec3;
  to: Vec3;
}

interface SliceViewProps {
  volume: VolumeBody;
  plane: Plane;
  point: Signal<Vec3>;
  window: Window;
  marks: SliceMark[];
  lines: SliceLine[];
  /** Without slider, letters' captions and key handling: a view that only follows. */
  follows?: boolean;
  /** Shows this much around the point rather than all of the CT. */
  reach_mm?: number;
}

const kNames: Record<Plane, string> = { transaxial: "Transaxial", coronal: "Coronal", sagittal: "Sagittal" };
const kStepSign: Record<Plane, number> = { transaxial: 1, coronal: 1, sagittal: 1 };

export function SliceView(props: SliceViewProps) {
  const { volume, plane, point, follows } = props;
  const view = kViews[plane];
  const through = view.through;
  const box = boundsOf(volume);
  const level = point.value[through];
  const geometry = sliceGeometry(volume, plane, point.value, props.reach_mm);
  const hover = useSignal<Vec3 | null>(null);
  const step = stepOf(volume, through);
  const page = (steps: number): void => {
    const next: Vec3 = [...point.value];
    next[through] = clamp(
      next[through] + steps * step * kStepSign[plane],
      box.low[through],
      box.high[through],
    );
    point.value = next;
  };
  const hu = useComputed(() => Math.round(samplePatient(volume, hover.value ?? point.value)));
  return (
    <section class={`slice slice-${plane}`} aria-label={`${kNames[plane]} slice`}>
      <Picture {...props} geometry={geometry} hover={hover} page={page} />
      <span class="slice-name">
        {kNames[plane]} <span class="dim">{axisText(through, level)}</span>
      </span>
      {!follows && (
        <span class="slice-hu" data-hu={hu.value}>
          {hu.value < -1500 ? "outside" : `${hu.value} HU`}
        </span>
      )}
      <span class="letter letter-left">{view.letters.left}</span>
      <span class="letter letter-right">{view.letters.right}</span>
      <span class="letter letter-top">{view.letters.top}</span>
      <span class="letter letter-bottom">{view.letters.bottom}</span>
      {!follows && (
        <input
          class="slice-slider"
          type="range"
          aria-label={`${kNames[plane]} position`}
          min={box.low[through]}
          max={box.high[through]}
          step={step}
          value={level}
          onInput={(event) => {
            const next: Vec3 = [...point.value];
            next[through] = Number(event.currentTarget.value);
            point.value = next;
          }}
        />
      )}
    </section>
  );
}

interface PictureProps extends SliceViewProps {
  geometry: SliceGeometry;
  hover: Signal<Vec3 | null>;
  page: (steps: number) => void;
}

function Picture({
  volume,
  plane,
  point,
  window,
  marks,
  lines,
  follows,
  geometry,
  hover,
  page,
}: PictureProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const svg = useRef<SVGSVGElement>(null);
  const through = kViews[plane].through;
  const level = point.value[through];
  useEffect(() => {
    const context = canvas.current!.getContext("2d")!;
    const image = context.createImageData(geometry.width, geometry.height);
    renderSlice(volume, geometry, window, image.data);
    context.putImageData(image, 0, 0);
  }, [volume, plane, window, level, geometry.corner.join()]);
  useWheel(svg, (event) => page(Math.sign(event.deltaY)), follows !== true);
  const patientAt = (event: PointerEvent): Vec3 => {
    const to_picture = svg.current!.getScreenCTM()!.inverse();
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(to_picture);
    const column = clamp(at.x - 0.5, 0, geometry.width - 1);
    const row = clamp(at.y - 0.5, 0, geometry.height - 1);
    return pixelToPatient(geometry, column, row);
  };
  const pointer = (event: PointerEvent): void => {
    if (follows) return;
    const at = patientAt(event);
    hover.value = at;
    if (event.type === "pointerdown") svg.current!.setPointerCapture(event.pointerId);
    if (event.type === "pointerdown" || event.buttons & 1) point.value = at;
  };
  return (
    <div
      class="slice-picture"
      role="group"
      aria-label={`${kNames[plane]} picture; arrow keys move the crosshair, Page Up and Page Down turn pages`}
      tabIndex={follows ? -1 : 0}
      onKeyDown={(event) => {
        if (!follows && moveByKey(event, geometry, point, page)) event.preventDefault();
      }}
    >
      <canvas ref={canvas} width={geometry.width} height={geometry.height} />
      <svg
        ref={svg}
        viewBox={`0 0 ${geometry.width} ${geometry.height}`}
        aria-hidden="true"
        onPointerDown={pointer}
        onPointerMove={pointer}
        onPointerLeave={() => {
          hover.value = null;
        }}
      >
        <Overlay geometry={geometry} point={point.value} marks={marks} lines={lines} crosshair={!follows} />
      </svg>
    </div>
  );
}

interface OverlayProps {
  geometry: SliceGeometry;
  point: Vec3;
  marks: SliceMark[];
  lines: SliceLine[];
  crosshair: boolean;
}

function Overlay({ geometry, point, marks, lines, crosshair }: OverlayProps) {
  const view = kViews[geometry.plane];
  const level = point[view.through];
  const pixel = (p: Vec3): [number, number] => {
    const [x, y] = patientToPixel(geometry, p);
    return [x + 0.5, y + 0.5];
  };
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

/** Wheel listeners must be active ones to keep the page from scrolling; JSX makes passive ones. */
function useWheel(target: { current: Element | null }, act: (event: WheelEvent) => void, on: boolean): void {
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

function moveByKey(
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

/** One voxel along the patient axis nearest to a grid axis. */
function stepOf(volume: VolumeBody, through: 0 | 1 | 2): number {
  const axis: Vec3 = [0, 0, 0];
  axis[through] = 1;
  const along = volume.axes.map((a) => Math.abs(dot(a, axis)));
  return volume.spacing[along.indexOf(Math.max(...along))]!;
}

function axisText(through: 0 | 1 | 2, level: number): string {
  const [minus, plus] = [
    ["R", "L"],
    ["A", "P"],
    ["F", "H"],
  ][through] as [string, string];
  return `${Math.abs(level).toFixed(1)} mm ${level < 0 ? minus : plus}`;
}

function clamp(v: number, low: number, high: number): number {
  return Math.max(low, Math.min(high, v));
}
