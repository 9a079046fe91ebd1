// Drill: the hand pushes the bit, the core cuts, the server does the same and the page says whether both agree.
import { type Signal, useComputed, useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { PointVolumeBody, Vec3 } from "../contract/bodies";
import type { PathInfo } from "../contract/rest";
import { kBoneWindow, kPlanes } from "../geometry/slice";
import { directionToPatient, toPatient } from "../geometry/vec";
import type { VertebraScene } from "../scene/vertebra_scene";
import { fetchPointVolume } from "../state/api";
import { type CaseData, loadCase, pathAsDrilled } from "../state/case_data";
import { DrillSession } from "../state/drill_session";
import { useLoaded } from "../state/load";
import { keepLocally, parseMetrics } from "../state/local_recordings";
import { addressOf, kLocalRecording } from "../state/route";
import { type Hand, type HandEvent, handAfter, kRestingHand, steeringOf } from "../state/steering";
import { DrillControls } from "./drill_controls";
import { attachHand } from "./drill_input";
import { DrillReadings, ThrustChart } from "./drill_readings";
import { ForceChart } from "./force_chart";
import { attachGamepad } from "./gamepad_input";
import { MetricsTable } from "./metrics";
import { caseCrumbs, Failure, TopBar, Waiting } from "./parts";
import { BitLooks, Toggle } from "./scene_tools";
import { SceneView } from "./scene_view";
import { ServerBadge } from "./server_badge";
import { sliceMarks } from "./slice_marks";
import { SliceView } from "./slice_view";

interface Opened {
  data: CaseData;
  path: PathInfo;
  raw: Uint8Array;
  body: PointVolumeBody;
}

async function open(case_id: string, path_id: string): Promise<Opened> {
  const data = await loadCase(case_id);
  const path = await pathAsDrilled(data.detail, path_id);
  const { raw, body } = await fetchPointVolume(case_id, path_id);
  return { data, path, raw, body };
}

export function DrillRoom({ case_id, path_id }: { case_id: string; path_id: string }) {
  const attempt = useSignal(0);
  const loaded = useLoaded(String(attempt.value), () => open(case_id, path_id)).value;
  const label = loaded.state === "ready" ? loaded.value.data.detail.label : case_id;
  const here = loaded.state === "ready" ? `Drill ${loaded.value.path.label || path_id}` : "Drill";
  return (
    <div class="page fixed">
      <TopBar crumbs={caseCrumbs(case_id, label, here)} />
      <main id="main" class="room" tabIndex={-1}>
        {loaded.state === "loading" && <Waiting text="Fetching the modelled bone" />}
        {loaded.state === "failed" && (
          <Failure
            title="This path cannot be drilled"
            message={loaded.message}
            retry={() => {
              ++attempt.value;
            }}
          />
        )}
        {loaded.state === "ready" && <Drilling opened={loaded.value} />}
      </main>
    </div>
  );
}

function Drilling({ opened }: { opened: Opened }) {
  const { data, path } = opened;
  const session = useMemo(() => new DrillSession(), []);
  const hand = useSignal<Hand>(kRestingHand);
  const tell = (event: HandEvent): void => {
    hand.value = handAfter(hand.value, event);
  };
  useEffect(() => {
    void session.open(data.detail.id, path, opened.raw);
    return () => session.close();
  }, []);
  useSignalEffect(() => {
    session.steer(steeringOf(hand.value));
  });
  useEffect(() => attachGamepad({ hand, tell, readings: session.readings }), []);
  useSignalEffect(() => {
    const recording = session.outcome.value?.recording;
    if (recording) keepLocally(data.detail.id, recording);
  });
  return (
    <div class="drill-room">
      <DrillPicture opened={opened} session={session} hand={hand} tell={tell} />
      <aside class="panel drill-panel" aria-label="Readings and controls">
        <h1 class="panel-title">{path.label || "Drill"}</h1>
        <ServerBadge agreement={session.agreement} />
        <Trouble session={session} />
        <DrillReadings path={path} body={opened.body} session={session} />
        <ForceChart session={session} />
        {session.phase.value === "finished" ? (
          <Finished session={session} case_id={data.detail.id} />
        ) : (
          <DrillControls hand={hand} tell={tell} session={session} />
        )}
        <ThrustChart session={session} path={path} />
      </aside>
    </div>
  );
}

function Trouble({ session }: { session: DrillSession }) {
  if (!session.trouble.value) return null;
  return (
    <p class="trouble" role="alert">
      The drill stopped: {session.trouble.value}
    </p>
  );
}

interface PictureProps {
  opened: Opened;
  session: DrillSession;
  hand: Signal<Hand>;
  tell: (event: HandEvent) => void;
}

function DrillPicture({ opened, session, hand, tell }: PictureProps) {
  const { data, path, body } = opened;
  const scene = useRef<VertebraScene | null>(null);
  const glass = useSignal(false);
  const cut_away = useSignal(false);
  const ghost = useSignal(false);
  const plan = useSignal(true);
  useSignalEffect(() => scene.current?.setGlass(glass.value));
  useSignalEffect(() => scene.current?.setPlan(plan.value));
  useSignalEffect(() => {
    scene.current?.setCutAway(cut_away.value);
    session.watchAlive(cut_away.value);
  });
  useSignalEffect(() => scene.current?.bit?.setGhost(ghost.value));
  useSignalEffect(() => {
    const readings = session.readings.value;
    if (!readings || !scene.current) return;
    scene.current.setBit(readings.tip, readings.axis);
    scene.current.spin = readings.spinning && session.phase.value === "drilling" ? 14 : 0;
  });
  const ready = (made: VertebraScene): (() => void) => {
    scene.current = made;
    made.setGuides(null);
    made.showPaths([path], path, false);
    made.openPointVolume(body);
    made.lookAtEntry();
    session.onSplats = (change) => made.change(change);
    session.onAlive = (alive) => made.setAlive(alive);
    const detach = attachHand(made, {
      hand,
      tell,
      nudge: (across) => session.nudge(across),
      wheel: (push_N) => session.wheel(push_N),
    });
    return () => {
      detach();
      session.onSplats = null;
      session.onAlive = null;
      scene.current = null;
    };
  };
  return (
    <div class="drill-picture">
      <SceneView data={data} label="The bit in the vertebra" onReady={ready}>
        <div class="scene-tools">
          <BitLooks scene={scene} ghost={ghost} />
          <button
            type="button"
            aria-pressed={cut_away.value}
            onClick={() => {
              cut_away.value = !cut_away.value;
              if (cut_away.value) scene.current?.lookAcrossPath();
            }}
          >
            Cut-away
          </button>
          <Toggle text="Glass bone" on={glass} />
          <Toggle text="Ghost bit" on={ghost} />
          <Toggle text="Plan" on={plan} />
        </div>
        <OutsideNote session={session} path={path} />
      </SceneView>
      <TipSlices data={data} path={path} session={session} />
    </div>
  );
}

/** The three slices through the tip, a few times a second. */
function TipSlices({ data, path, session }: { data: CaseData; path: PathInfo; session: DrillSession }) {
  const point = useSignal<Vec3>(path.entry_patient);
  const pose = useSignal<{ tip: Vec3; axis: Vec3 } | null>(null);
  useEffect(() => {
    let shown = "";
    const timer = setInterval(() => {
      const readings = session.readings.peek();
      if (!readings) return;
      const key = [...readings.tip, ...readings.axis].map((v) => v.toFixed(2)).join();
      if (key === shown) return;
      shown = key;
      point.value = toPatient(path.frame, readings.tip);
      pose.value = { tip: point.value, axis: directionToPatient(path.frame, readings.axis) };
    }, 120);
    return () => clearInterval(timer);
  }, [session, path, point, pose]);
  const { marks, lines } = sliceMarks([path], path, pose.value);
  return (
    <div class="tip-slices">
      {kPlanes.map((plane) => (
        <SliceView
          key={plane}
          volume={data.volume!}
          plane={plane}
          point={point}
          window={kBoneWindow}
          marks={marks}
          lines={lines}
          follows
          reach_mm={26}
        />
      ))}
    </div>
  );
}

/** Beyond the modelled cylinder there are no points to cut: say so, rather than pass through bone in silence. */
function OutsideNote({ session, path }: { session: DrillSession; path: PathInfo }) {
  const outside = useComputed(() => {
    const readings = session.readings.value;
    if (!readings || readings.depth_mm < 0) return false;
    const { first_disc, discs, spacing_mm } = path.lattice;
    const limit = path.volume_radius_mm - path.bit.diameter_mm / 2;
    const beside = Math.hypot(readings.tip[0], readings.tip[1]) > limit + 1e-6;
    return beside || readings.tip[2] > (first_disc + discs - 1) * spacing_mm + 1e-6;
  });
  if (!outside.value) return null;
  return (
    <p class="scene-note" role="status">
      The bit has left the modelled bone around the path; what it touches there is not cut.
    </p>
  );
}

function Finished({ session, case_id }: { session: DrillSession; case_id: string }) {
  const outcome = session.outcome.value!;
  const metrics = parseMetrics(outcome.metrics_json);
  const recording_id = outcome.recording_id ?? kLocalRecording;
  return (
    <section class="finished" aria-label="The finished drill">
      <h2>Finished</h2>
      {outcome.recording_id === null ? (
        <p class="dim">
          The server has not said that it kept this drill. It can be replayed here until the page is closed.
        </p>
      ) : (
        <p class="dim">
          Kept as recording <code>{outcome.recording_id}</code>.
        </p>
      )}
      {metrics && <MetricsTable metrics={metrics} />}
      <div class="row">
        <a class="button primary" href={addressOf({ room: "replay", case_id, recording_id })}>
          Replay
        </a>
        <a class="button" href={addressOf({ room: "case", case_id, path_id: null })}>
          Back to the case
        </a>
      </div>
    </section>
  );
}
