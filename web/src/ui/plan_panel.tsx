// The paths of a plan, the bit of the chosen one, and whether all of it is saved.
import { useSignal } from "@preact/signals";
import type { Vec3 } from "../contract/bodies";
import { bitWith, commonBitOf, kCommonBits, kDiameter_mm, kLength_mm } from "../state/bits";
import { lengthOf, type PlannedPath } from "../state/plan";
import type { PlanSession } from "../state/plan_session";
import { addressOf } from "../state/route";
import { counted, Fact, pointText } from "./parts";

interface PlanPanelProps {
  session: PlanSession;
  case_id: string;
  /** Where a new path begins. */
  point: () => Vec3;
  /** The vertebra's middle across, about which a path is mirrored. */
  middle_x: number;
  onChoose: (key: string) => void;
}

export function PlanPanel({ session, case_id, point, middle_x, onChoose }: PlanPanelProps) {
  const chosen = session.chosen.value;
  return (
    <section>
      <h2>Paths</h2>
      <SaveBadge session={session} />
      {!chosen && <p class="dim">No path is planned yet. New path begins one at the crosshair.</p>}
      <PathList session={session} chosen={chosen} onChoose={onChoose} />
      <div class="row path-actions">
        <button type="button" onClick={() => session.add(point())}>
          New path
        </button>
        <button type="button" disabled={!chosen} onClick={() => session.mirror(middle_x)}>
          Mirror
        </button>
        <button type="button" disabled={!chosen} onClick={() => session.remove()}>
          Delete path
        </button>
      </div>
      {chosen && <PathFacts session={session} path={chosen} case_id={case_id} />}
    </section>
  );
}

function PathList({
  session,
  chosen,
  onChoose,
}: {
  session: PlanSession;
  chosen: PlannedPath | null;
  onChoose: (key: string) => void;
}) {
  return (
    <div class="path-list" role="radiogroup" aria-label="Path to drill">
      {session.plan.value.map((path) => (
        <label key={path.key} class="path-card">
          <input
            type="radio"
            name="path"
            checked={path.key === chosen?.key}
            onChange={() => onChoose(path.key)}
          />
          <span class="path-name">{path.label || "Path"}</span>
          <span class="dim">
            {lengthOf(path).toFixed(1)} mm, bit {path.bit.diameter_mm.toFixed(1)} mm
          </span>
        </label>
      ))}
    </div>
  );
}

function PathFacts({ session, path, case_id }: { session: PlanSession; path: PlannedPath; case_id: string }) {
  const kept = session.chosen_kept.value;
  return (
    <>
      <BitFields session={session} path={path} />
      <dl class="facts">
        <Fact name="Entry" value={pointText(path.entry_patient)} />
        <Fact name="Target" value={pointText(path.target_patient)} />
        <Fact
          name="Modelled bone"
          value={
            kept
              ? `${counted(kept.points_alive, "point")}, ${kept.spacing_mm} mm apart`
              : "made when it is saved"
          }
        />
      </dl>
      {kept ? (
        <a class="button primary" href={addressOf({ room: "drill", case_id, path_id: kept.id })}>
          Drill this path
        </a>
      ) : (
        <button type="button" class="button primary" disabled>
          Drill this path, once it is saved
        </button>
      )}
    </>
  );
}

function BitFields({ session, path }: { session: PlanSession; path: PlannedPath }) {
  const { bit } = path;
  const common = commonBitOf(bit);
  return (
    <fieldset class="bit-fields" aria-label="Bit or screw">
      <label class="wide">
        Name
        <input
          type="text"
          maxLength={60}
          value={path.label}
          onChange={(event) => session.rename(event.currentTarget.value)}
        />
      </label>
      <label class="wide">
        Bit
        <select
          value={common?.name ?? ""}
          onChange={(event) => {
            const one = kCommonBits.find(({ name }) => name === event.currentTarget.value);
            if (one) session.setBit(bitWith(bit, one));
            session.settle();
          }}
        >
          {!common && <option value="">Another</option>}
          {kCommonBits.map(({ name }) => (
            <option key={name} value={name}>
              {name}
            </option>
          ))}
        </select>
      </label>
      <MmField
        name="Diameter"
        range={kDiameter_mm}
        value={bit.diameter_mm}
        onValue={(diameter_mm) => {
          session.setBit(bitWith(bit, { diameter_mm }));
          session.settle();
        }}
      />
      <MmField
        name="Length"
        range={kLength_mm}
        value={bit.length_mm}
        onValue={(length_mm) => {
          session.setBit(bitWith(bit, { length_mm }));
          session.settle();
        }}
      />
    </fieldset>
  );
}

/** Taken over when it is finished; what lies outside goes to the nearest limit, and is shown so. */
function MmField({
  name,
  range,
  value,
  onValue,
}: {
  name: string;
  range: { low: number; high: number; step: number };
  value: number;
  onValue: (value: number) => void;
}) {
  const attempt = useSignal(0);
  return (
    <label>
      {name}, mm
      <input
        key={attempt.value}
        type="number"
        min={range.low}
        max={range.high}
        step={range.step}
        value={value}
        onChange={(event) => {
          const wanted = event.currentTarget.valueAsNumber;
          if (Number.isFinite(wanted)) onValue(wanted);
          if (!(wanted >= range.low && wanted <= range.high)) ++attempt.value;
        }}
      />
    </label>
  );
}

const kSaveTexts = { saved: "Saved", waiting: "Not saved yet", saving: "Saving" } as const;

export function SaveBadge({ session }: { session: PlanSession }) {
  const save = session.save.value;
  if (save.state !== "failed") {
    return (
      <p class={`save save-${save.state}`} data-save={save.state} role="status">
        {kSaveTexts[save.state]}
      </p>
    );
  }
  const reason = save.reason.charAt(0).toUpperCase() + save.reason.slice(1);
  return (
    <div class="save save-failed" data-save="failed" role="alert">
      <span>
        Not saved: {reason}
        {save.retry_s !== null && ` Trying again in ${save.retry_s} s.`}
      </span>
      <button type="button" onClick={() => session.retry()}>
        Try now
      </button>
    </div>
  );
}
