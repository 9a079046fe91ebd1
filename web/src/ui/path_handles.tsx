// The ends of the chosen path, to be taken hold of: by mouse, by touch, and by keys. Over a slice, and over the 3-D picture.
import { useRef } from "preact/hooks";
import type { Vec3 } from "../contract/bodies";
import type { DrawnPath } from "../contract/rest";
import { kViews, patientToPixel, pixelToPatient, type SliceGeometry } from "../geometry/slice";
import { add, scale } from "../geometry/vec";
import type { VertebraScene } from "../scene/vertebra_scene";
import { type End, kEnds } from "../state/plan";
import { pointText } from "./parts";

/** How a room takes edits of its chosen path. */
export interface PathEditing {
  path: DrawnPath;
  /** Steps of one gesture are undone together. */
  move: (end: End, to: Vec3, gesture: string) => void;
  /** The gesture is over. */
  settle: () => void;
}

/** Of an arrow key, and with shift. */
export const kStep_mm = 0.5;
export const kFineStep_mm = 0.1;
/** A handle whose end is farther from the slice is drawn dimmed: it is only projected. */
export const kNear_mm = 1;

const kNames: Record<End, string> = { entry: "Entry", target: "Target" };

interface HandleProps {
  editing: PathEditing;
  end: End;
  /** Of the picture, 0 .. 1 from its left and top. */
  at: { x: number; y: number };
  far: boolean;
  /** CSS pixels, from where the drag began. */
  dragged: (from: Vec3, right_px: number, down_px: number) => Vec3;
  /** Steps of an arrow key; `away`: page keys. */
  stepped: (right_mm: number, down_mm: number, away_mm: number) => Vec3;
}

function Handle({ editing, end, at, far, dragged, stepped }: HandleProps) {
  const drag = useRef<{ id: number; x: number; y: number; from: Vec3 } | null>(null);
  const here = end === "entry" ? editing.path.entry_patient : editing.path.target_patient;
  const over = (event: PointerEvent): void => {
    if (drag.current?.id !== event.pointerId) return;
    drag.current = null;
    editing.settle();
  };
  return (
    <button
      type="button"
      class={`handle handle-${end} ${far ? "handle-far" : ""}`}
      data-end={end}
      style={{ left: `${100 * at.x}%`, top: `${100 * at.y}%` }}
      aria-label={`${kNames[end]} of ${editing.path.label || "the path"}, ${pointText(here)}; arrow keys move it`}
      title={`${kNames[end]}: drag, or arrow keys (Shift: ${kFineStep_mm} mm)`}
      onPointerDown={(event) => {
        if (event.button !== 0 || event.altKey) return;
        event.stopPropagation();
        event.currentTarget.setPointerCapture(event.pointerId);
        editing.settle();
        drag.current = { id: event.pointerId, x: event.clientX, y: event.clientY, from: here };
      }}
      onPointerMove={(event) => {
        const begun = drag.current;
        if (begun?.id !== event.pointerId) return;
        editing.move(end, dragged(begun.from, event.clientX - begun.x, event.clientY - begun.y), "drag");
      }}
      onPointerUp={over}
      onPointerCancel={over}
      onKeyDown={(event) => {
        const step = stepOfKey(event);
        if (!step) return;
        event.preventDefault();
        event.stopPropagation();
        editing.move(end, stepped(...step), "keys");
      }}
      onKeyUp={() => editing.settle()}
      onBlur={() => editing.settle()}
    />
  );
}

function stepOfKey(event: KeyboardEvent): Vec3 | null {
  if (event.altKey || event.ctrlKey || event.metaKey) return null;
  const steps: Record<string, Vec3> = {
    ArrowLeft: [-1, 0, 0],
    ArrowRight: [1, 0, 0],
    ArrowUp: [0, -1, 0],
    ArrowDown: [0, 1, 0],
    PageUp: [0, 0, 1],
    PageDown: [0, 0, -1],
  };
  const step = steps[event.key];
  return step ? scale(step, event.shiftKey ? kFineStep_mm : kStep_mm) : null;
}

/** In the frame of a slice's picture; an end beyond its edge has none. */
export function SliceHandles({
  editing,
  geometry,
  level,
  pixel_css,
}: {
  editing: PathEditing;
  geometry: SliceGeometry;
  level: number;
  /** CSS pixels that one of the picture spans. */
  pixel_css: () => number;
}) {
  const { right, down, through } = kViews[geometry.plane];
  return (
    <>
      {kEnds.map((end) => {
        const here = end === "entry" ? editing.path.entry_patient : editing.path.target_patient;
        const [column, row] = patientToPixel(geometry, here);
        const at = { x: (column + 0.5) / geometry.width, y: (row + 0.5) / geometry.height };
        if (at.x < 0 || at.x > 1 || at.y < 0 || at.y > 1) return null;
        return (
          <Handle
            key={end}
            editing={editing}
            end={end}
            at={at}
            far={Math.abs(here[through] - level) > kNear_mm}
            dragged={(from, right_px, down_px) => {
              const css = pixel_css();
              const [c, r] = patientToPixel(geometry, from);
              const moved = pixelToPatient(
                geometry,
                clamp(c + right_px / css, geometry.width),
                clamp(r + down_px / css, geometry.height),
              );
              // The depth across the slice stays the end's own, also when the slice is not at it.
              moved[through] = from[through];
              return moved;
            }}
            stepped={(right_mm, down_mm, away_mm) => {
              const across = add(scale(right, right_mm), scale(down, down_mm));
              across[through] = away_mm;
              return add(here, across);
            }}
          />
        );
      })}
    </>
  );
}

function clamp(v: number, size: number): number {
  return Math.max(0, Math.min(size - 1, v));
}

/** Over the 3-D picture; drags stay in the plane of the screen. `drawn` changes with every picture. */
export function SceneHandles({
  editing,
  scene,
  drawn,
}: {
  editing: PathEditing;
  scene: VertebraScene;
  drawn: number;
}) {
  return (
    <div class="handle-frame" data-drawn={drawn}>
      {kEnds.map((end) => {
        const here = end === "entry" ? editing.path.entry_patient : editing.path.target_patient;
        const at = scene.pictureOf(here);
        if (!at || at.x < 0 || at.x > 1 || at.y < 0 || at.y > 1) return null;
        return (
          <Handle
            key={end}
            editing={editing}
            end={end}
            at={at}
            far={false}
            dragged={(from, right_px, down_px) => scene.movedOnScreen(from, right_px, down_px)}
            stepped={(right_mm, down_mm, away_mm) => scene.movedAcross(here, right_mm, -down_mm, away_mm)}
          />
        );
      })}
    </div>
  );
}
