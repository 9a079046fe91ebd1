// The drill's controls: spin, feed, pads, the keys shown, and the end.
import type { Signal } from "@preact/signals";
import type { DrillSession } from "../state/drill_session";
import type { Hand, HandEvent } from "../state/steering";
import { Pad } from "./pads";

interface ControlsProps {
  hand: Signal<Hand>;
  tell: (event: HandEvent) => void;
  session: DrillSession;
}

const kFeeds = [0.5, 1, 2, 5, 10];

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
        <label class="select">
          <span>Feed</span>
          <select
            value={String(now.feed_mm_s)}
            onChange={(event) => tell({ type: "feed", mm_s: Number(event.currentTarget.value) })}
          >
            {kFeeds.map((feed) => (
              <option key={feed} value={String(feed)}>
                {feed} mm/s
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
          label="In and out"
          ends={["Out", "In"]}
          onPush={([, up]) => tell({ type: "pad_advance", value: -up })}
        />
        <KeyHelp />
      </div>
      <p class="dim small">
        The pointer moves the bit when dragged on it, and its wheel there goes in and out.
      </p>
      <button
        type="button"
        class="primary finish"
        disabled={phase !== "drilling"}
        onClick={() => session.finish()}
      >
        {phase === "opening" ? "Starting the core" : phase === "finishing" ? "Finishing" : "Finish the drill"}
      </button>
    </section>
  );
}

const kHelp: [string[], string][] = [
  [["W", "S"], "in, out"],
  [["↑", "↓", "←", "→"], "sideways"],
  [["Q", "E", "R", "F"], "lean"],
  [["Shift"], "fine"],
  [["Space"], "spin"],
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
