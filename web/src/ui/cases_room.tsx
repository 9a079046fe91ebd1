// Cases: what there is to drill.
import { useSignal } from "@preact/signals";
import type { CaseSummary } from "../contract/rest";
import { fetchCases } from "../state/api";
import { useLoaded } from "../state/load";
import { addressOf } from "../state/route";
import { counted, Failure, TopBar, Waiting, whenText } from "./parts";

export function CasesRoom() {
  const attempt = useSignal(0);
  const cases = useLoaded(`cases ${attempt.value}`, fetchCases);
  const loaded = cases.value;
  return (
    <div class="page">
      <TopBar crumbs={[{ text: "Cases" }]} />
      <main id="main" class="cases" tabIndex={-1}>
        <h1>Cases</h1>
        {loaded.state === "loading" && <Waiting text="Fetching the cases" />}
        {loaded.state === "failed" && (
          <Failure
            title="The cases could not be fetched"
            message={loaded.message}
            retry={() => {
              ++attempt.value;
            }}
          />
        )}
        {loaded.state === "ready" && (loaded.value.length === 0 ? <Empty /> : <List cases={loaded.value} />)}
      </main>
    </div>
  );
}

function List({ cases }: { cases: CaseSummary[] }) {
  return (
    <ul class="case-list">
      {cases.map((one) => (
        <li key={one.id}>
          <a class="case-card" href={addressOf({ room: "case", case_id: one.id, path_id: null })}>
            <span class="case-name">{one.label}</span>
            <span class={`stage stage-${one.stage}`}>{one.stage}</span>
            <span class="case-counts">
              {counted(one.paths, "path")} · {counted(one.recordings, "recording")}
            </span>
            <span class="case-when">
              {whenText(one.created)} · <code>{one.id}</code>
            </span>
          </a>
        </li>
      ))}
    </ul>
  );
}

function Empty() {
  return (
    <section class="empty">
      <h2>No cases yet</h2>
      <p>Make one from a CT stack, or from the built-in phantom. In a terminal, type:</p>
      <pre>
        {`spinaltap phantom     --out phantom
spinaltap import      --from phantom
spinaltap segment     CASE
spinaltap reconstruct CASE
spinaltap plan        CASE --entry x,y,z --target x,y,z`}
      </pre>
      <p>
        Each command prints the case id that the next one takes as <code>CASE</code>. Then reload this page.
      </p>
    </section>
  );
}
