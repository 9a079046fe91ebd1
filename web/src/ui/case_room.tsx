// Case: the vertebra in 3-D with its three slices, the planned paths, and the way to Drill and Replay.
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useMemo, useRef } from "preact/hooks";
import type { Vec3 } from "../contract/bodies";
import type { CaseDetail, PathInfo, RecordingInfo } from "../contract/rest";
import { bitSolid, holeSolid } from "../geometry/section";
import { kBoneWindow, kPlanes, type Window } from "../geometry/slice";
import { add, mix, scale, toPatient } from "../geometry/vec";
import type { VertebraScene } from "../scene/vertebra_scene";
import { meshFileUrl } from "../state/api";
import { type CaseData, loadCase, pathOf } from "../state/case_data";
import { useLoaded } from "../state/load";
import { addressOf, goTo } from "../state/route";
import { caseCrumbs, counted, Failure, TopBar, Waiting, whenText } from "./parts";
import { Toggle } from "./scene_tools";
import { SceneView } from "./scene_view";
import { type SliceLine, type SliceMark, SliceView } from "./slice_view";

export function CaseRoom({ case_id, path_id }: { case_id: string; path_id: string | null }) {
  const attempt = useSignal(0);
  const loaded = useLoaded(`${case_id} ${attempt.value}`, () => loadCase(case_id)).value;
  return (
    <div class="page fixed">
      <TopBar
        crumbs={caseCrumbs(case_id, loaded.state === "ready" ? loaded.value.detail.label : case_id, null)}
      />
      <main id="main" class="room" tabIndex={-1}>
        {loaded.state === "loading" && <Waiting text="Fetching the case: its CT and its surface" />}
        {loaded.state === "failed" && (
          <Failure
            title="This case could not be opened"
            message={loaded.message}
            retry={() => {
              ++attempt.value;
            }}
          />
        )}
        {loaded.state === "ready" && <Opened data={loaded.value} path_id={path_id} />}
      </main>
    </div>
  );
}

function Opened({ data, path_id }: { data: CaseData; path_id: string | null }) {
  const { detail } = data;
  const path = pathOf(detail, path_id) ?? detail.paths[0] ?? null;
  if (!data.mesh || !data.volume) return <NotReconstructed detail={detail} />;
  return (
    <div class="case-room">
      <Views data={data} path={path} />
      <aside class="panel" aria-label="Paths and recordings">
        <h1 class="panel-title">{detail.label}</h1>
        <Paths detail={detail} chosen={path} />
        <Recordings detail={detail} />
        <Figures figures={detail.figures} />
        <Downloads case_id={detail.id} />
      </aside>
    </div>
  );
}

function NotReconstructed({ detail }: { detail: CaseDetail }) {
  const next = detail.stage === "imported" ? "segment" : "reconstruct";
  return (
    <section class="empty">
      <h1>{detail.label} has no surface yet</h1>
      <p>It is {detail.stage}. In a terminal, type:</p>
      <pre>{`spinaltap ${next} ${detail.id}${next === "segment" ? `\nspinaltap reconstruct ${detail.id}` : ""}`}</pre>
      <p>Then reload this page.</p>
    </section>
  );
}

export function sliceMarks(
  paths: PathInfo[],
  chosen: PathInfo | null,
  bit: { tip: Vec3; axis: Vec3 } | null,
): { marks: SliceMark[]; lines: SliceLine[] } {
  const marks: SliceMark[] = [];
  const lines: SliceLine[] = [];
  for (const path of paths) {
    const z = path.frame.axes[2];
    const mine = path.id === chosen?.id;
    const solid = holeSolid(path.entry_patient, z, path.length_mm, path.bit.diameter_mm);
    marks.push({ kind: mine ? "hole" : "other", solid });
    lines.push({
      kind: mine ? "path" : "other",
      from: add(path.entry_patient, scale(z, -18)),
      to: path.target_patient,
    });
  }
  if (bit && chosen) marks.push({ kind: "bit", solid: bitSolid(bit.tip, bit.axis, chosen.bit) });
  return { marks, lines };
}

function Views({ data, path }: { data: CaseData; path: PathInfo | null }) {
  const volume = data.volume!;
  const scene = useRef<VertebraScene | null>(null);
  const point = useSignal<Vec3>(data.centre);
  const glass = useSignal(false);
  const guides = useSignal(true);
  const window = useSignal<Window>(kBoneWindow);
  useEffect(() => {
    if (path) point.value = mix(path.entry_patient, path.target_patient, 0.3);
    scene.current?.showPaths(data.detail.paths, path);
  }, [path?.id]);
  useSignalEffect(() => {
    scene.current?.setGuides(guides.value ? point.value : null);
  });
  useSignalEffect(() => {
    scene.current?.setGlass(glass.value);
  });
  const { marks, lines } = useMemo(
    () => sliceMarks(data.detail.paths, path, path && standing(path)),
    [data.detail.paths, path],
  );
  return (
    <div class="quad">
      <SceneView
        data={data}
        label="Vertebra in 3-D"
        onReady={(made) => {
          scene.current = made;
          made.showPaths(data.detail.paths, path);
          made.setGuides(guides.value ? point.value : null);
          return () => {
            scene.current = null;
          };
        }}
      >
        <div class="scene-tools">
          <Toggle text="Glass bone" on={glass} />
          <Toggle text="Guide planes" on={guides} />
          <button type="button" onClick={() => scene.current?.lookAlongBit()} disabled={!path}>
            Along the bit
          </button>
        </div>
      </SceneView>
      {kPlanes.map((plane) => (
        <SliceView
          key={plane}
          volume={volume}
          plane={plane}
          point={point}
          window={window.value}
          marks={marks}
          lines={lines}
        />
      ))}
    </div>
  );
}

/** Where the bit stands before a drill: its tip a little before the entry. */
function standing(path: PathInfo): { tip: Vec3; axis: Vec3 } {
  return { tip: toPatient(path.frame, [0, 0, -6]), axis: path.frame.axes[2] };
}

function Paths({ detail, chosen }: { detail: CaseDetail; chosen: PathInfo | null }) {
  if (!chosen) {
    return (
      <section>
        <h2>Paths</h2>
        <p class="dim">No path is planned. In a terminal, type:</p>
        <pre>{`spinaltap plan ${detail.id} --entry x,y,z --target x,y,z`}</pre>
      </section>
    );
  }
  return (
    <section>
      <h2>Paths</h2>
      <div class="path-list" role="radiogroup" aria-label="Path to drill">
        {detail.paths.map((path) => (
          <label key={path.id} class="path-card">
            <input
              type="radio"
              name="path"
              checked={path.id === chosen.id}
              onChange={() => goTo({ room: "case", case_id: detail.id, path_id: path.id })}
            />
            <span class="path-name">{path.label || `Path ${path.id}`}</span>
            <span class="dim">
              {path.length_mm.toFixed(1)} mm, bit {path.bit.diameter_mm.toFixed(1)} mm
            </span>
          </label>
        ))}
      </div>
      <dl class="facts">
        <Fact name="Entry" value={pointText(chosen.entry_patient)} />
        <Fact name="Target" value={pointText(chosen.target_patient)} />
        <Fact
          name="Modelled bone"
          value={`${counted(chosen.points_alive, "point")}, ${chosen.spacing_mm} mm apart`}
        />
      </dl>
      <a class="button primary" href={addressOf({ room: "drill", case_id: detail.id, path_id: chosen.id })}>
        Drill this path
      </a>
    </section>
  );
}

function Fact({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

/** In the letters of the picture, not in signs. */
function pointText([x, y, z]: Vec3): string {
  const one = (v: number, minus: string, plus: string): string =>
    `${v < 0 ? minus : plus} ${Math.abs(v).toFixed(1)}`;
  return `${one(x, "R", "L")}  ${one(y, "A", "P")}  ${one(z, "F", "H")} mm`;
}

function Recordings({ detail }: { detail: CaseDetail }) {
  const recordings = [...detail.recordings].sort((a, b) => b.created.localeCompare(a.created));
  return (
    <section>
      <h2>Recordings</h2>
      {recordings.length === 0 && <p class="dim">Nothing has been drilled yet.</p>}
      <ul class="recording-list">
        {recordings.map((recording) => (
          <li key={recording.id}>
            <a href={addressOf({ room: "replay", case_id: detail.id, recording_id: recording.id })}>
              <span>Replay {whenText(recording.created)}</span>
              <span class="dim">{recordingText(detail, recording)}</span>
            </a>
          </li>
        ))}
      </ul>
    </section>
  );
}

function recordingText(detail: CaseDetail, recording: RecordingInfo): string {
  const path = pathOf(detail, recording.path_id);
  const parts = [path?.label ?? recording.path_id, `${(recording.cycles / 1000).toFixed(1)} s`];
  if (!recording.complete) parts.push("cut short");
  return parts.join(" · ");
}

function Downloads({ case_id }: { case_id: string }) {
  return (
    <p class="dim">
      Download the surface, in mm:{" "}
      <a href={meshFileUrl(case_id, "stl")} download>
        STL
      </a>
      {" · "}
      <a href={meshFileUrl(case_id, "ply")} download>
        PLY
      </a>
    </p>
  );
}

const kFigureNames: [string, string, string][] = [
  ["triangles", "Triangles", ""],
  ["centres", "RBF centres", ""],
  ["boundary_points", "Boundary points", ""],
  ["residual_rms_mm", "Fit error, RMS", "mm"],
  ["residual_max_mm", "Fit error, largest", "mm"],
];

function Figures({ figures }: { figures: CaseDetail["figures"] }) {
  const known = kFigureNames.filter(([key]) => typeof figures?.[key] === "number");
  if (known.length === 0) return null;
  return (
    <section>
      <h2>Surface</h2>
      <dl class="facts">
        {known.map(([key, name, unit]) => {
          const value = figures![key] as number;
          const text = unit === "" ? value.toLocaleString("en") : `${value.toFixed(3)} ${unit}`;
          return <Fact key={key} name={name} value={text} />;
        })}
      </dl>
    </section>
  );
}
