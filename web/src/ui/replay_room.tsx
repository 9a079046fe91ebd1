// Replay: a finished drill, moment by moment, re-run by the core in this browser and checked against its hashes.
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import { type PointVolumeBody, pointVolume_mm3 } from "../contract/bodies";
import type { Metrics, PathInfo } from "../contract/rest";
import type { VertebraScene } from "../scene/vertebra_scene";
import { fetchPointVolume, fetchRecording, findRecording } from "../state/api";
import { type CaseData, loadCase, pathAsDrilled } from "../state/case_data";
import { useLoaded } from "../state/load";
import { keptLocally } from "../state/local_recordings";
import { ReplaySession } from "../state/replay_session";
import { addressOf, kLocalRecording } from "../state/route";
import { kStandOff_mm } from "../worker/motion";
import { Chart } from "./chart";
import { MetricsTable } from "./metrics";
import { caseCrumbs, Failure, Reading, TopBar, Waiting } from "./parts";
import { BitLooks, Toggle } from "./scene_tools";
import { SceneView } from "./scene_view";

interface Opened {
  data: CaseData;
  path: PathInfo;
  body: PointVolumeBody;
  bytes: Uint8Array;
  metrics: Metrics | null;
}

async function open(case_id: string, recording_id: string): Promise<Opened> {
  const data = await loadCase(case_id);
  const local = recording_id === kLocalRecording ? keptLocally(case_id) : null;
  if (recording_id === kLocalRecording && !local) {
    throw new Error("That drill lived in the page that made it, and is gone with it.");
  }
  const known = findRecording(data.detail, recording_id);
  const bytes = local ?? (await fetchRecording(recording_id));
  const drilled = known ? await pathAsDrilled(data.detail, known.path_id) : null;
  const path = drilled ?? data.detail.paths[0];
  if (!path) throw new Error("The path of this recording is no longer there.");
  const { body } = await fetchPointVolume(case_id, path.id);
  return { data, path, body, bytes, metrics: known?.metrics ?? null };
}

export function ReplayRoom({ case_id, recording_id }: { case_id: string; recording_id: string }) {
  const attempt = useSignal(0);
  const loaded = useLoaded(String(attempt.value), () => open(case_id, recording_id)).value;
  const label = loaded.state === "ready" ? loaded.value.data.detail.label : case_id;
  return (
    <div class="page fixed">
      <TopBar crumbs={caseCrumbs(case_id, label, "Replay")} />
      <main id="main" class="room" tabIndex={-1}>
        {loaded.state === "loading" && <Waiting text="Fetching the recording" />}
        {loaded.state === "failed" && (
          <Failure
            title="This recording cannot be replayed"
            message={loaded.message}
            retry={() => {
              ++attempt.value;
            }}
          />
        )}
        {loaded.state === "ready" && <Replaying opened={loaded.value} recording_id={recording_id} />}
      </main>
    </div>
  );
}

function Replaying({ opened, recording_id }: { opened: Opened; recording_id: string }) {
  const { data, path } = opened;
  const session = useMemo(() => new ReplaySession(opened.bytes), [opened.bytes]);
  useEffect(() => () => session.close(), [session]);
  return (
    <div class="drill-room">
      <div class="replay-picture">
        <ReplayPicture opened={opened} session={session} />
        <Timeline session={session} />
      </div>
      <aside class="panel" aria-label="Readings and metrics">
        <h1 class="panel-title">{path.label || "Replay"}</h1>
        <VerifiedBadge session={session} />
        {session.trouble.value && (
          <p class="trouble" role="alert">
            The replay stopped: {session.trouble.value}
          </p>
        )}
        <Readings session={session} opened={opened} />
        <Plots session={session} path={path} />
        {opened.metrics && (
          <section>
            <h2>Metrics</h2>
            <MetricsTable metrics={opened.metrics} />
          </section>
        )}
        <div class="row">
          <a class="button" href={addressOf({ room: "drill", case_id: data.detail.id, path_id: path.id })}>
            Drill again
          </a>
          <a class="button" href={addressOf({ room: "case", case_id: data.detail.id, path_id: path.id })}>
            Back to the case
          </a>
        </div>
        <p class="dim small">
          Recording <code>{recording_id}</code>
        </p>
      </aside>
    </div>
  );
}

function VerifiedBadge({ session }: { session: ReplaySession }) {
  const verdict = session.verdict.value;
  if (!verdict) {
    return (
      <p class="badge badge-connecting" data-verified="pending" role="status">
        <span class="badge-dot" aria-hidden="true" />
        <span>Re-running every cycle to verify</span>
      </p>
    );
  }
  return (
    <p
      class={`badge badge-${verdict.verified ? "agrees" : "differs"}`}
      data-verified={String(verdict.verified)}
      data-hash={verdict.hash}
      role="status"
    >
      <span class="badge-dot" aria-hidden="true" />
      <span>
        {verdict.verified
          ? `Verified: ${verdict.cycles.toLocaleString("en")} cycles re-run, same state`
          : verdict.finding.replace(/^n/, "N")}
      </span>
    </p>
  );
}

function ReplayPicture({ opened, session }: { opened: Opened; session: ReplaySession }) {
  const { data, path, body } = opened;
  const scene = useRef<VertebraScene | null>(null);
  const glass = useSignal(false);
  const cut_away = useSignal(true);
  const ghost = useSignal(false);
  const plan = useSignal(true);
  useSignalEffect(() => scene.current?.setGlass(glass.value));
  useSignalEffect(() => scene.current?.setPlan(plan.value));
  useSignalEffect(() => scene.current?.setCutAway(cut_away.value));
  useSignalEffect(() => scene.current?.bit?.setGhost(ghost.value));
  useSignalEffect(() => {
    const moment = session.moment.value;
    if (moment && scene.current) scene.current.showMoment(moment.pose, moment.splats, moment.alive);
  });
  const ready = (made: VertebraScene): (() => void) => {
    scene.current = made;
    made.setGuides(null);
    made.showPaths([path], path, false);
    made.openPointVolume(body);
    made.setCutAway(cut_away.value);
    made.lookAcrossPath();
    const moment = session.moment.peek();
    if (moment) made.showMoment(moment.pose, moment.splats, moment.alive);
    return () => {
      scene.current = null;
    };
  };
  return (
    <SceneView data={data} label="The recorded drill" onReady={ready}>
      <div class="scene-tools">
        <BitLooks scene={scene} ghost={ghost} />
        <button type="button" onClick={() => scene.current?.lookAcrossPath()}>
          Across
        </button>
        <Toggle text="Cut-away" on={cut_away} />
        <Toggle text="Glass bone" on={glass} />
        <Toggle text="Ghost bit" on={ghost} />
        <Toggle text="Plan" on={plan} />
      </div>
    </SceneView>
  );
}

const kSpeeds = [0.25, 0.5, 1, 2, 4, 8];

function Timeline({ session }: { session: ReplaySession }) {
  const last = session.cycles.value;
  const cycle = session.cycle.value;
  return (
    <section class="timeline" aria-label="Timeline">
      <button
        type="button"
        class="primary play"
        disabled={last === 0}
        aria-label={session.playing.value ? "Pause" : "Play"}
        onClick={() => session.togglePlay()}
      >
        {session.playing.value ? "❚❚" : "▶"}
      </button>
      <input
        type="range"
        aria-label="Moment, in cycles"
        aria-valuetext={`${session.timeAt(cycle).toFixed(1)} seconds`}
        min={0}
        max={last}
        step={1}
        value={cycle}
        disabled={last === 0}
        onInput={(event) => session.seek(Number(event.currentTarget.value))}
      />
      <span class="time number">
        {session.timeAt(cycle).toFixed(2)} <span class="dim">/ {session.timeAt(last).toFixed(2)} s</span>
      </span>
      <label class="select">
        <span class="hidden">Speed</span>
        <select
          value={String(session.speed.value)}
          onChange={(event) => {
            session.speed.value = Number(event.currentTarget.value);
          }}
        >
          {kSpeeds.map((speed) => (
            <option key={speed} value={String(speed)}>
              {speed}×
            </option>
          ))}
        </select>
      </label>
    </section>
  );
}

function Readings({ session, opened }: { session: ReplaySession; opened: Opened }) {
  const pose = session.moment.value?.pose;
  const volume = pointVolume_mm3(opened.body.lattice);
  return (
    <dl class="readings" data-cycle={session.moment.value?.cycle}>
      <Reading name="Depth" value={(pose?.depth_mm ?? 0).toFixed(2)} unit="mm" />
      <Reading name="Thrust" value={(pose?.thrust_N ?? 0).toFixed(2)} unit="N" />
      <Reading name="Bone removed" value={((pose?.removed_total ?? 0) * volume).toFixed(1)} unit="mm³" />
      <Reading name="Cycle" value={session.cycle.value.toLocaleString("en")} unit="" />
    </dl>
  );
}

function Plots({ session, path }: { session: ReplaySession; path: PathInfo }) {
  const plots = session.plots.value;
  const pose = session.moment.value?.pose;
  if (!plots) return null;
  const time = session.timeAt(session.cycle.value);
  return (
    <>
      <Chart
        series={{ points: plots.thrust_over_depth }}
        version={plots.version}
        x={{
          name: "depth",
          unit: "mm",
          low: -Math.ceil(path.lead_mm + kStandOff_mm),
          high: Math.ceil(path.length_mm + 6),
        }}
        y={{ name: "thrust", unit: "N", least_high: 4 }}
        rules={[
          { at: 0, name: "entry", colour: "#5fe08a" },
          { at: path.length_mm, name: "target", colour: "#f2a541" },
        ]}
        cursor={pose ? [pose.depth_mm, pose.thrust_N] : null}
        label="Thrust over depth"
      />
      <Chart
        series={{ points: plots.depth_over_time }}
        version={plots.version}
        x={{ name: "time", unit: "s", low: 0, high: Math.max(1, session.timeAt(session.cycles.value)) }}
        y={{ name: "depth", unit: "mm", least_high: path.length_mm }}
        cursor={pose ? [time, Math.max(0, pose.depth_mm)] : null}
        label="Depth over time"
      />
    </>
  );
}
