// Numbers and gauges of a drill that goes on.
import { type PointVolumeBody, pointVolume_mm3 } from "../contract/bodies";
import type { PathInfo } from "../contract/rest";
import type { DrillSession } from "../state/drill_session";
import { kMostPush_N, kStandOff_mm } from "../worker/motion";
import { Chart } from "./chart";
import { Reading } from "./parts";

interface ReadingsProps {
  path: PathInfo;
  body: PointVolumeBody;
  session: DrillSession;
}

export function DrillReadings({ path, body, session }: ReadingsProps) {
  const readings = session.readings.value;
  const volume = pointVolume_mm3(body.lattice);
  const past = (readings?.depth_mm ?? 0) - path.length_mm;
  const thrust_N = readings?.thrust_N ?? 0;
  return (
    <div class="reading-group">
      <dl class="readings">
        <Reading name="Depth" value={(readings?.depth_mm ?? 0).toFixed(2)} unit="mm" hot={past > 0.5} />
        <Reading name="Thrust" value={zeroed(thrust_N).toFixed(2)} unit="N" />
        <Reading name="Bone removed" value={((readings?.removed ?? 0) * volume).toFixed(1)} unit="mm³" />
        <Reading name="Cycles" value={rateText(readings?.rate_hz ?? 0)} unit="a second" />
      </dl>
      <div class="gauges">
        <Gauge name="Push" newtons={readings?.push_N ?? 0} kind="push" />
        <Gauge name="Felt" newtons={thrust_N} kind="felt" />
      </div>
      <p class="reading-note">
        {past > 0.5 ? `${past.toFixed(1)} mm past the target` : `Target at ${path.length_mm.toFixed(1)} mm`}
        {` · ${(readings?.cycle ?? 0).toLocaleString("en")} cycles`}
      </p>
    </div>
  );
}

/** What is pushed beside what is felt: while the bit stands they are equal, and when bone lets go they part. */
function Gauge({ name, newtons, kind }: { name: string; newtons: number; kind: "push" | "felt" }) {
  const shown = zeroed(newtons);
  const share = Math.min(1, Math.abs(shown) / kMostPush_N);
  return (
    <div class={`gauge gauge-${kind}`}>
      <span class="gauge-name">{name}</span>
      <div
        class="gauge-track"
        role="meter"
        aria-label={name === "Push" ? "Push, N" : "Force felt, N"}
        aria-valuemin={-kMostPush_N}
        aria-valuemax={kMostPush_N}
        aria-valuenow={Math.round(shown * 10) / 10}
      >
        <span
          class={shown < 0 ? "gauge-bar gauge-back" : "gauge-bar"}
          style={{ transform: `scaleX(${share})` }}
        />
      </div>
      <span class="gauge-value number">{shown.toFixed(1)} N</span>
    </div>
  );
}

/** No "-0.00". */
function zeroed(newtons: number): number {
  return Math.abs(newtons) < 0.005 ? 0 : newtons;
}

function rateText(hz: number): string {
  return hz < 1 ? "idle" : Math.round(hz).toLocaleString("en");
}

export function ThrustChart({ session, path }: { session: DrillSession; path: PathInfo }) {
  const readings = session.readings.value;
  const cursor: [number, number] | null = readings ? [readings.depth_mm, readings.thrust_N] : null;
  const low = -Math.ceil(path.lead_mm + kStandOff_mm);
  return (
    <Chart
      series={{ points: session.trace }}
      version={session.trace_version.value}
      x={{ name: "depth", unit: "mm", low, high: Math.ceil(path.length_mm + 6) }}
      y={{ name: "thrust", unit: "N", least_high: 4 }}
      rules={[
        { at: 0, name: "entry", colour: "#5fe08a" },
        { at: path.length_mm, name: "target", colour: "#f2a541" },
      ]}
      cursor={cursor}
      label="Thrust over depth"
    />
  );
}
