// Case: the vertebra in 3-D with its three slices, its plan, which is edited here, and the way to Drill and Replay.
import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Vec3 } from "../contract/bodies";
import type { CaseDetail, RecordingInfo } from "../contract/rest";
import { fetchPath, meshFileUrl } from "../state/api";
import { type CaseData, loadCase, pathOf } from "../state/case_data";
import { useLoaded } from "../state/load";
import { type PlanSession, planSessionOf } from "../state/plan_session";
import { addressOf, goTo, renameTo } from "../state/route";
import { caseCrumbs, Fact, Failure, TopBar, Waiting, whenText } from "./parts";
import { PlanPanel } from "./plan_panel";
import { PlanViews } from "./plan_views";

interface OpenCase {
  data: CaseData;
  session: PlanSession;
}

async function openCase(case_id: string, path_id: string | null): Promise<OpenCase> {
  const data = await loadCase(case_id);
  const session = planSessionOf(data.detail);
  const now = path_id && (await pathNow(data.detail, path_id));
  if (now) session.choose(now);
  return { data, session };
}

/** Links to a path stay good after it was replaced: the one in its place is opened. */
async function pathNow(detail: CaseDetail, path_id: string): Promise<string | null> {
  for (let id = path_id, hops = 0; id !== "" && hops < 50; ++hops) {
    if (pathOf(detail, id)) return id;
    try {
      id = (await fetchPath(detail.id, id)).replaced_by;
    } catch {
      return null;
    }
  }
  return null;
}

export function CaseRoom({ case_id, path_id }: { case_id: string; path_id: string | null }) {
  const attempt = useSignal(0);
  const loaded = useLoaded(`${case_id} ${attempt.value}`, () => openCase(case_id, path_id)).value;
  return (
    <div class="page fixed">
      <TopBar
        crumbs={caseCrumbs(
          case_id,
          loaded.state === "ready" ? loaded.value.data.detail.label : case_id,
          null,
        )}
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
        {loaded.state === "ready" && <Opened {...loaded.value} path_id={path_id} />}
      </main>
    </div>
  );
}

function Opened({ data, session, path_id }: OpenCase & { path_id: string | null }) {
  const { detail } = data;
  const point = useSignal<Vec3>(data.centre);
  useAddress(detail.id, session, path_id);
  if (!data.mesh || !data.volume) return <NotReconstructed detail={detail} />;
  return (
    <div class="case-room">
      <PlanViews data={data} session={session} point={point} />
      <aside class="panel" aria-label="Paths and recordings">
        <h1 class="panel-title">{detail.label}</h1>
        <PlanPanel
          session={session}
          case_id={detail.id}
          point={() => point.peek()}
          middle_x={data.centre[0]}
          onChoose={(key) => {
            session.choose(key);
            const id = session.kept.peek().get(key)?.id;
            if (id) goTo({ room: "case", case_id: detail.id, path_id: id });
          }}
        />
        <Recordings detail={detail} />
        <Figures figures={detail.figures} />
        <Downloads case_id={detail.id} />
      </aside>
    </div>
  );
}

/** The address names the chosen path, once the server has an id for it; Back and links choose another. */
function useAddress(case_id: string, session: PlanSession, path_id: string | null): void {
  useEffect(() => {
    if (path_id && [...session.kept.peek().values()].some(({ id }) => id === path_id))
      session.choose(path_id);
  }, [path_id]);
  const chosen = session.chosen.value;
  const id = chosen && session.kept.value.get(chosen.key)?.id;
  const edited = session.history.value.past.length > 0;
  useEffect(() => {
    if (id && id !== path_id && (path_id !== null || edited))
      renameTo({ room: "case", case_id, path_id: id });
  }, [id, edited]);
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
  const parts = [path?.label ?? "a path changed since", `${(recording.cycles / 1000).toFixed(1)} s`];
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
