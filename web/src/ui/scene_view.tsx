// The 3-D picture's place on the page: canvas, viewpoint buttons, keys, the little axes.
import { useSignal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Vector3 } from "three";
import { kViewpoints } from "../scene/stage";
import { VertebraScene } from "../scene/vertebra_scene";
import type { CaseData } from "../state/case_data";
import { messageOf } from "../state/load";

interface SceneViewProps {
  data: CaseData;
  label: string;
  /** Called once with the scene; what it returns is called before the scene goes. */
  onReady: (scene: VertebraScene) => undefined | (() => void);
  children?: ComponentChildren;
}

export function SceneView({ data, label, onReady, children }: SceneViewProps) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<VertebraScene | null>(null);
  const trouble = useSignal<string | null>(null);
  const axes = useSignal<AxisTip[]>([]);
  useEffect(() => {
    let made: VertebraScene;
    try {
      made = new VertebraScene(canvas.current!, data);
    } catch (error) {
      trouble.value = `3-D drawing is not available in this browser (${messageOf(error)}).`;
      return;
    }
    scene.current = made;
    made.stage.onLost = (lost) => {
      trouble.value = lost ? "The graphics were interrupted; waiting for them to come back." : null;
    };
    made.stage.onView = () => {
      axes.value = axisTips(made);
    };
    const leave = onReady(made);
    return () => {
      leave?.();
      scene.current = null;
      made.dispose();
    };
  }, [data]);
  return (
    <section class="scene" aria-label={label}>
      <div
        class="scene-canvas"
        role="group"
        aria-label={`${label}; arrow keys with Alt turn the picture, plus and minus zoom`}
        tabIndex={0}
        onKeyDown={(event) => {
          if (scene.current && turnByKey(event, scene.current)) event.preventDefault();
        }}
      >
        <canvas ref={canvas} />
      </div>
      {trouble.value && (
        <p class="scene-trouble" role="alert">
          {trouble.value}
        </p>
      )}
      <Gizmo tips={axes.value} />
      <fieldset class="viewpoints" aria-label="Viewpoints">
        {Object.entries(kViewpoints).map(([key, view]) => (
          <button
            key={key}
            type="button"
            title={`Look ${view.name}`}
            aria-label={`Look ${view.name}`}
            onClick={() => scene.current?.lookFrom(key)}
          >
            {key}
          </button>
        ))}
        <button
          type="button"
          aria-label="Zoom in"
          title="Zoom in"
          onClick={() => scene.current?.stage.zoomBy(0.8)}
        >
          +
        </button>
        <button
          type="button"
          aria-label="Zoom out"
          title="Zoom out"
          onClick={() => scene.current?.stage.zoomBy(1.25)}
        >
          −
        </button>
      </fieldset>
      {children}
    </section>
  );
}

interface AxisTip {
  letter: string;
  x: number;
  y: number;
  depth: number;
}

function axisTips(scene: VertebraScene): AxisTip[] {
  const letters: [string, Vector3][] = [
    ["L", new Vector3(1, 0, 0)],
    ["R", new Vector3(-1, 0, 0)],
    ["P", new Vector3(0, 1, 0)],
    ["A", new Vector3(0, -1, 0)],
    ["H", new Vector3(0, 0, 1)],
    ["F", new Vector3(0, 0, -1)],
  ];
  return letters
    .map(([letter, axis]) => {
      const seen = axis.transformDirection(scene.view);
      return { letter, x: seen.x, y: -seen.y, depth: seen.z };
    })
    .sort((a, b) => a.depth - b.depth);
}

function Gizmo({ tips }: { tips: AxisTip[] }) {
  return (
    <svg class="gizmo" viewBox="-40 -40 80 80" aria-hidden="true">
      {tips.map((tip) => (
        <g key={tip.letter} class={`tip tip-${tip.letter}`} opacity={0.35 + 0.65 * ((tip.depth + 1) / 2)}>
          <line x1={0} y1={0} x2={tip.x * 24} y2={tip.y * 24} />
          <text x={tip.x * 32} y={tip.y * 32}>
            {tip.letter}
          </text>
        </g>
      ))}
    </svg>
  );
}

function turnByKey(event: KeyboardEvent, scene: VertebraScene): boolean {
  const zooms: Record<string, number> = { "+": 0.9, "=": 0.9, "-": 1.1 };
  const zoom = zooms[event.key];
  if (zoom !== undefined) scene.stage.zoomBy(zoom);
  if (zoom !== undefined || !event.altKey) return zoom !== undefined;
  const turns: Record<string, [number, number]> = {
    ArrowLeft: [-0.1, 0],
    ArrowRight: [0.1, 0],
    ArrowUp: [0, 0.1],
    ArrowDown: [0, -0.1],
  };
  const turn = turns[event.key];
  if (turn) scene.stage.orbitBy(...turn);
  return turn !== undefined;
}
