// The drill's controls: spin, sound, strength, pads, the keys shown, and the end.
import type { Signal } from "@preact/signals";
import type { DrillSession } from "../state/drill_session";
import type { Hand, HandEvent } from "../state/steering";
import { Pad } from "./pads";
import { SoundSwitch } from "./sound_switch";

interface ControlsProps {
  hand: Signal<Hand>;
  tell: (event: HandEvent) => void;
  session: DrillSession;
}

const kStrengths_N = [5, 10, 15, 20, 30, 40];

export function DrillControls({ hand, tell, session }: ControlsProps) {
  const now = hand.value;
  const phase = session.phase.value;
  return (
    <section class="controls" aria-label="Controls">
      <div class="row">
        <button
          type="button"
          class="spin"
          aria-pressed={now.spinning}
          onClick={() => tell({ type: "spin", on: !now.spinning })}
        >
          {now.spinning ? "Bit is turning" : "Bit stands still"}
        </button>
        <SoundSwitch session={session} />
        <label class="select">
          <span>Keys push</span>
          <select
            value={String(now.strength_N)}
            onChange={(event) => tell({ type: "strength", push_N: Number(event.currentTarget.value) })}
          >
            {kStrengths_N.map((strength) => (
              <option key={strength} value={String(strength)}>
                {strength} N
              </option>
            ))}
          </select>
        </label>
      </div>
      <div class="pads">
        <Pad
          shape="round"
          label="Sideways"
          ends={["Sideways", ""]}
          onPush={(value) => tell({ type: "pad_sideways", value })}
        />
        <Pad
          shape="tall"
          label="Push and pull"
          ends={["Pull", "Push"]}
          onPush={([, up]) => tell({ type: "pad_push", value: -up })}
        />
        <KeyHelp />
      </div>
      <button
        type="button"
        class="primary finish"
        disabled={phase !== "drilling"}
        onClick={() => session.finish()}
      >
        {phase === "opening" ? "Starting the core" : phase === "finishing" ? "Finishing" : "Finish the drill"}
      </button>
      {phase === "finishing" && session.agreement.value.kind === "reconnecting" && (
        <button type="button" class="finish" onClick={() => session.finishAlone()}>
          Finish without the server
        </button>
      )}
      <p class="dim small">
        On the bit, dragging aims and the wheel pushes; let go, and nothing pushes. A gamepad's right trigger
        pushes, the left pulls, its sticks aim and lean.
      </p>
    </section>
  );
}

const kHelp: [string[], string][] = [
  [["W", "S"], "push, pull"],
  [["↑", "↓", "←", "→"], "aim"],
  [["Q", "E", "R", "F"], "lean"],
  [["Shift"], "fine"],
  [["Space"], "spin"],
  [["M"], "sound"],
];

function KeyHelp() {
  return (
    <dl class="key-help">
      {kHelp.map(([keys, means]) => (
        <div key={means}>
          <dt>
            {keys.map((key) => (
              <kbd key={key}>{key}</kbd>
            ))}
          </dt>
          <dd>{means}</dd>
        </div>
      ))}
    </dl>
  );
}
