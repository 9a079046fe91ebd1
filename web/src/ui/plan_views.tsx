// The four linked views of a plan: 3-D and three slices through one patient point, with the path's ends to take hold of.
import { type Signal, useComputed, useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { Vec3 } from "../contract/bodies";
import type { DrawnPath } from "../contract/rest";
import { boundsOf, kBoneWindow, kPlanes, type Window } from "../geometry/slice";
import { mix, toPatient } from "../geometry/vec";
import type { VertebraScene } from "../scene/vertebra_scene";
import type { CaseData } from "../state/case_data";
import { escaped, kNotMeasuring, type Measuring } from "../state/measure";
import type { End } from "../state/plan";
import type { PlanSession } from "../state/plan_session";
import { presetOfKey } from "../state/windowing";
import { isTyping } from "./drill_input";
import { type PathEditing, SceneHandles } from "./path_handles";
import { PlanTools } from "./plan_tools";
import { Toggle } from "./scene_tools";
import { SceneView } from "./scene_view";
import { clamp } from "./slice_input";
import { sliceMarks } from "./slice_marks";
import { SliceView } from "./slice_view";

interface PlanViewsProps {
  data: CaseData;
  session: PlanSession;
  /** The one point that every view shows. */
  point: Signal<Vec3>;
}

/** Before the entry, where the bit stands ready. */
const kReady_mm = -6;

export function PlanViews({ data, session, point }: PlanViewsProps) {
  const window = useSignal<Window>(kBoneWindow);
  const measuring = useSignal<Measuring>(kNotMeasuring);
  const in_place = useSignal(false);
  const path = session.chosen_drawn.value;
  const editing = useEditing(data, session, point);
  usePlanKeys(session, window, measuring);
  useEffect(() => {
    if (path) point.value = mix(path.entry_patient, path.target_patient, 0.3);
  }, [path?.id]);
  const { marks, lines } = useComputed(() => {
    const chosen = session.chosen_drawn.value;
    return sliceMarks(session.drawn.value, chosen, chosen && bitOn(chosen, in_place.value));
  }).value;
  return (
    <div class="plan-views">
      <PlanTools session={session} window={window} measuring={measuring} />
      <div class="quad">
        <PlanScene data={data} session={session} point={point} editing={editing} in_place={in_place} />
        {kPlanes.map((plane) => (
          <SliceView
            key={plane}
            volume={data.volume!}
            plane={plane}
            point={point}
            window={window.value}
            marks={marks}
            lines={lines}
            onWindow={(next) => {
              window.value = next;
            }}
            editing={measuring.value.tool === "crosshair" ? editing : null}
            measuring={measuring}
          />
        ))}
      </div>
    </div>
  );
}

function bitOn(path: DrawnPath, in_place: boolean): { tip: Vec3; axis: Vec3 } {
  return {
    tip: toPatient(path.frame, [0, 0, in_place ? path.length_mm : kReady_mm]),
    axis: path.frame.axes[2],
  };
}

/** The views go along with the end that is moved, and nothing leaves the CT. */
function useEditing(data: CaseData, session: PlanSession, point: Signal<Vec3>): PathEditing | null {
  const path = session.chosen_drawn.value;
  if (!path) return null;
  const { low, high } = boundsOf(data.volume!);
  return {
    path,
    move: (end: End, to: Vec3, gesture: string) => {
      const inside = to.map((v, a) => clamp(v, low[a]!, high[a]!)) as Vec3;
      session.moveEnd(end, inside, gesture);
      point.value = inside;
    },
    settle: () => session.settle(),
  };
}

/** Keys that work wherever the focus is in this room, but for fields that are being filled in. */
function usePlanKeys(session: PlanSession, window: Signal<Window>, measuring: Signal<Measuring>): void {
  useEffect(() => {
    const down = (event: KeyboardEvent): void => {
      if (isTyping(event.target) && !(event.target as Element).matches("[type=range], [type=radio]")) return;
      if (event.ctrlKey || event.metaKey) {
        const key = event.key.toLowerCase();
        if (key !== "z" && key !== "y") return;
        event.preventDefault();
        if (key === "y" || event.shiftKey) session.redo();
        else session.undo();
        return;
      }
      if (event.altKey) return;
      const preset = presetOfKey(event.key);
      if (preset) window.value = preset.window;
      if (event.key === "Escape") measuring.value = escaped(measuring.value);
    };
    document.addEventListener("keydown", down);
    return () => document.removeEventListener("keydown", down);
  }, [session, window, measuring]);
}

interface PlanSceneProps extends PlanViewsProps {
  editing: PathEditing | null;
  in_place: Signal<boolean>;
}

function PlanScene({ data, session, point, editing, in_place }: PlanSceneProps) {
  const scene = useRef<VertebraScene | null>(null);
  const drawn = useSignal(0);
  const glass = useSignal(false);
  const guides = useSignal(true);
  const show = (made: VertebraScene): void => {
    const path = session.chosen_drawn.value;
    made.showPaths(session.drawn.value, path);
    if (path) made.setBit([0, 0, in_place.value ? path.length_mm : kReady_mm], [0, 0, 1]);
  };
  useSignalEffect(() => {
    session.drawn.value; // read here, so that the effect also follows what came before the scene
    session.chosen_drawn.value;
    in_place.value;
    if (scene.current) show(scene.current);
  });
  useSignalEffect(() => {
    scene.current?.setGuides(guides.value ? point.value : null);
  });
  useSignalEffect(() => {
    scene.current?.setGlass(glass.value);
  });
  return (
    <SceneView
      data={data}
      label="Vertebra in 3-D"
      onReady={(made) => {
        scene.current = made;
        show(made);
        made.setGuides(guides.value ? point.value : null);
        const axes = made.stage.onView;
        made.stage.onView = (view) => {
          axes?.(view);
          ++drawn.value;
        };
        return () => {
          scene.current = null;
        };
      }}
    >
      {editing && drawn.value > 0 && scene.current && (
        <SceneHandles editing={editing} scene={scene.current} drawn={drawn.value} />
      )}
      <div class="scene-tools">
        <Toggle text="Glass bone" on={glass} />
        <Toggle text="Guide planes" on={guides} />
        <Toggle text="Bit in place" on={in_place} />
        <button type="button" onClick={() => scene.current?.lookAlongBit()} disabled={!editing}>
          Along the bit
        </button>
      </div>
    </SceneView>
  );
}
