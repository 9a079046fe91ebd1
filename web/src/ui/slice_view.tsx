// One slice of the CT, through the one patient point that all views share.
import { type Signal, useComputed, useSignal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Vec3, VolumeBody } from "../contract/bodies";
import {
  boundsOf,
  kViews,
  type Plane,
  pixelToPatient,
  renderSlice,
  type SliceGeometry,
  samplePatient,
  sliceGeometry,
  type Window,
} from "../geometry/slice";
import { dot } from "../geometry/vec";
import { kWhole, panned, type Zoom, zoomAbout, zoomed } from "../geometry/zoom";
import { type Measuring, shownIn, withPoint } from "../state/measure";
import { windowAfterDrag } from "../state/windowing";
import { type PathEditing, SliceHandles } from "./path_handles";
import { clamp, kZoomStep, moveByKey, useWheel, zoomByKey } from "./slice_input";
import type { SliceLine, SliceMark } from "./slice_marks";
import { MeasureTexts, Overlay } from "./slice_overlay";

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
  /** Called while the window is dragged. */
  onWindow?: (window: Window) => void;
  editing?: PathEditing | null;
  measuring?: Signal<Measuring>;
}

const kNames: Record<Plane, string> = { transaxial: "Transaxial", coronal: "Coronal", sagittal: "Sagittal" };

export function SliceView(props: SliceViewProps) {
  const { volume, plane, point, follows } = props;
  const view = kViews[plane];
  const through = view.through;
  const box = boundsOf(volume);
  const level = point.value[through];
  const whole = sliceGeometry(volume, plane, point.value, props.reach_mm);
  const zoom = useSignal<Zoom>(kWhole);
  const hover = useSignal<Vec3 | null>(null);
  const step = stepOf(volume, through);
  const page = (steps: number): void => {
    const next: Vec3 = [...point.value];
    next[through] = clamp(next[through] + steps * step, box.low[through], box.high[through]);
    point.value = next;
  };
  const hu = useComputed(() => Math.round(samplePatient(volume, hover.value ?? point.value)));
  return (
    <section class={`slice slice-${plane}`} aria-label={`${kNames[plane]} slice`}>
      <Picture {...props} whole={whole} zoom={zoom} hover={hover} page={page} step={step} />
      <span class="slice-name">
        {kNames[plane]} <span class="dim">{axisText(through, level)}</span>
        {zoom.value.factor > 1 && <span class="dim"> {zoom.value.factor.toFixed(1)}×</span>}
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
  whole: SliceGeometry;
  zoom: Signal<Zoom>;
  hover: Signal<Vec3 | null>;
  page: (steps: number) => void;
  step: number;
}

function Picture(props: PictureProps) {
  const { volume, plane, point, window, marks, lines, follows, whole, zoom, hover, page } = props;
  const { editing, measuring } = props;
  const canvas = useRef<HTMLCanvasElement>(null);
  const svg = useRef<SVGSVGElement>(null);
  const geometry = zoomed(whole, zoom.value);
  const level = point.value[kViews[plane].through];
  useEffect(() => {
    const context = canvas.current!.getContext("2d")!;
    const image = context.createImageData(geometry.width, geometry.height);
    renderSlice(volume, geometry, window, image.data);
    context.putImageData(image, 0, 0);
  }, [volume, plane, window, level, geometry.corner.join(), geometry.pixel_mm]);
  const drag = usePointer(props, geometry, svg);
  useWheel(
    svg,
    (event) => {
      // Browsers turn the wheel sideways while Shift is held.
      const turned = event.deltaY !== 0 ? event.deltaY : event.deltaX;
      if (!event.shiftKey) return page(Math.sign(turned));
      const [column, row] = drag.pixelAt(event);
      zoom.value = zoomAbout(whole, zoom.value, turned < 0 ? kZoomStep : 1 / kZoomStep, column, row);
    },
    follows !== true,
  );
  const measured = measuring
    ? shownIn(measuring.value, plane, level, props.step / 2, measuring.value.open ? hover.value : null)
    : [];
  const onKeyDown = (event: KeyboardEvent): void => {
    if (follows || event.ctrlKey || event.metaKey || event.altKey) return;
    const took =
      setByKey(event, measuring, plane, point.value) ||
      zoomByKey(event, whole, geometry, point.value, zoom) ||
      moveByKey(event, geometry, point, page);
    if (took) event.preventDefault();
  };
  return (
    <div
      class="slice-picture"
      role="group"
      aria-label={`${kNames[plane]} picture; arrow keys move the crosshair, Page Up and Page Down turn pages, plus and minus zoom`}
      tabIndex={follows ? -1 : 0}
      onKeyDown={onKeyDown}
      style={{ "--aspect": geometry.width / geometry.height }}
    >
      <div class="slice-frame">
        <canvas ref={canvas} width={geometry.width} height={geometry.height} />
        <svg
          ref={svg}
          viewBox={`0 0 ${geometry.width} ${geometry.height}`}
          aria-hidden="true"
          onPointerDown={drag.down}
          onPointerMove={drag.move}
          onPointerUp={drag.up}
          onPointerCancel={drag.up}
          onPointerLeave={() => {
            hover.value = null;
          }}
          onContextMenu={(event) => {
            if (!follows) event.preventDefault();
          }}
          onDblClick={() => {
            if (!follows) zoom.value = kWhole;
          }}
        >
          <Overlay
            geometry={geometry}
            point={point.value}
            marks={marks}
            lines={lines}
            measured={measured}
            crosshair={!follows}
          />
        </svg>
        <MeasureTexts geometry={geometry} measured={measured} />
        {editing && (
          <SliceHandles
            editing={editing}
            geometry={geometry}
            level={level}
            pixel_css={() => svg.current!.getScreenCTM()!.a}
          />
        )}
      </div>
    </div>
  );
}

/** Enter sets a point of a measurement at the crosshair: what a click does at the pointer. */
function setByKey(
  event: KeyboardEvent,
  measuring: Signal<Measuring> | undefined,
  plane: Plane,
  point: Vec3,
): boolean {
  if (event.key !== "Enter" || !measuring || measuring.value.tool === "crosshair") return false;
  if (event.target !== event.currentTarget) return false;
  measuring.value = withPoint(measuring.value, plane, point);
  return true;
}

type Drag =
  | { kind: "crosshair" }
  | { kind: "measure"; x: number; y: number }
  | { kind: "window"; x: number; y: number; from: Window }
  | { kind: "pan"; column: number; row: number };

/** Farther than this, a press was a drag: it sets the second point too. */
const kClick_px = 5;

function usePointer(
  { point, window, follows, whole, zoom, hover, onWindow, measuring, plane }: PictureProps,
  geometry: SliceGeometry,
  svg: { current: SVGSVGElement | null },
) {
  const drag = useRef<Drag | null>(null);
  const pixelAt = (event: MouseEvent): [number, number] => {
    const to_picture = svg.current!.getScreenCTM()!.inverse();
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(to_picture);
    return [clamp(at.x - 0.5, 0, geometry.width - 1), clamp(at.y - 0.5, 0, geometry.height - 1)];
  };
  const patientAt = (event: MouseEvent): Vec3 => pixelToPatient(geometry, ...pixelAt(event));
  const begun = (event: PointerEvent): Drag => {
    const { clientX: x, clientY: y } = event;
    if (onWindow && (event.button === 2 || (event.button === 0 && event.altKey)))
      return { kind: "window", x, y, from: window };
    if (event.button === 1) {
      const [column, row] = pixelAt(event);
      return { kind: "pan", column, row };
    }
    if (measuring && measuring.value.tool !== "crosshair") return { kind: "measure", x, y };
    return { kind: "crosshair" };
  };
  const setPoint = (at: Vec3): void => {
    measuring!.value = withPoint(measuring!.value, plane, at);
  };
  const move = (event: PointerEvent): void => {
    if (follows) return;
    const now = drag.current;
    if (now?.kind === "window") {
      onWindow?.(windowAfterDrag(now.from, event.clientX - now.x, event.clientY - now.y));
      return;
    }
    if (now?.kind === "pan") {
      const [column, row] = pixelAt(event);
      zoom.value = panned(whole, zoom.value, column - now.column, row - now.row);
      return;
    }
    hover.value = patientAt(event);
    if (now?.kind === "crosshair") point.value = hover.value;
  };
  return {
    pixelAt,
    move,
    down: (event: PointerEvent): void => {
      if (follows) return;
      drag.current = begun(event);
      svg.current!.setPointerCapture(event.pointerId);
      if (event.button === 1) event.preventDefault();
      if (drag.current.kind === "measure") setPoint(patientAt(event));
      else move(event);
    },
    up: (event: PointerEvent): void => {
      const now = drag.current;
      drag.current = null;
      if (now?.kind !== "measure" || !measuring?.value.open) return;
      if (Math.hypot(event.clientX - now.x, event.clientY - now.y) > kClick_px) setPoint(patientAt(event));
    },
  };
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
