// The bar over a plan's views: undo and redo, window presets, measuring.
import type { Signal } from "@preact/signals";
import type { Window } from "../geometry/slice";
import { kNotMeasuring, type Measure, type Measuring, withTool } from "../state/measure";
import type { PlanSession } from "../state/plan_session";
import { isSameWindow, kPresets } from "../state/windowing";

interface PlanToolsProps {
  session: PlanSession;
  window: Signal<Window>;
  measuring: Signal<Measuring>;
}

const kMeasures: [Measure, string, string][] = [
  ["length", "Length", "Two clicks, or a drag, in a slice; Enter sets a point at the crosshair"],
  ["angle", "Angle", "Three clicks in a slice, the corner second; Enter sets a point at the crosshair"],
];

export function PlanTools({ session, window, measuring }: PlanToolsProps) {
  const { past, future } = session.history.value;
  const { tool, done, open } = measuring.value;
  return (
    <div class="plan-tools" role="toolbar" aria-label="Plan tools">
      <button type="button" title="Undo (Ctrl+Z)" disabled={past.length === 0} onClick={() => session.undo()}>
        Undo
      </button>
      <button
        type="button"
        title="Redo (Ctrl+Shift+Z)"
        disabled={future.length === 0}
        onClick={() => session.redo()}
      >
        Redo
      </button>
      <fieldset class="presets" aria-label="Window">
        {kPresets.map((preset) => (
          <button
            key={preset.key}
            type="button"
            aria-pressed={isSameWindow(preset.window, window.value)}
            title={`${textOf(preset.window)} (key ${preset.key})`}
            aria-label={`${preset.name} ${textOf(preset.window)}`}
            onClick={() => {
              window.value = preset.window;
            }}
          >
            {preset.name}
          </button>
        ))}
      </fieldset>
      <span class="window-now" data-window={textOf(window.value)}>
        W {window.value.width_HU} L {window.value.level_HU}
      </span>
      {kMeasures.map(([measure, name, hint]) => (
        <button
          key={measure}
          type="button"
          aria-pressed={tool === measure}
          title={hint}
          onClick={() => {
            measuring.value = withTool(measuring.value, measure);
          }}
        >
          {name}
        </button>
      ))}
      {(done.length > 0 || open) && (
        <button
          type="button"
          title="Escape"
          onClick={() => {
            measuring.value = kNotMeasuring;
          }}
        >
          Clear
        </button>
      )}
    </div>
  );
}

/** Width over level, as it is written on a viewer's picture. */
function textOf({ width_HU, level_HU }: Window): string {
  return `${width_HU}/${level_HU}`;
}
