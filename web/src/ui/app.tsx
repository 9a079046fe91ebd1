// The frame around the rooms, and the choice of room by address.
import { addressOf, route } from "../state/route";
import { CaseRoom } from "./case_room";
import { CasesRoom } from "./cases_room";
import { DrillRoom } from "./drill_room";
import { ReplayRoom } from "./replay_room";

export function App() {
  return (
    <>
      <button type="button" class="skip" onClick={skip}>
        Skip to the content
      </button>
      <Room />
    </>
  );
}

/** Not a link: the address's hash is the room. */
function skip(): void {
  document.getElementById("main")?.focus();
}

function Room() {
  const here = route.value;
  switch (here.room) {
    case "cases":
      return <CasesRoom />;
    case "case":
      return <CaseRoom key={here.case_id} case_id={here.case_id} path_id={here.path_id} />;
    case "drill":
      return <DrillRoom key={addressOf(here)} case_id={here.case_id} path_id={here.path_id} />;
    case "replay":
      return <ReplayRoom key={addressOf(here)} case_id={here.case_id} recording_id={here.recording_id} />;
    case "unknown":
      return (
        <main id="main" class="notice" tabIndex={-1}>
          <h1>No such room</h1>
          <p>The address {here.address} leads nowhere.</p>
          <a class="button" href="#/">
            All cases
          </a>
        </main>
      );
  }
}
