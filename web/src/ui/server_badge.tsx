// Whether the server's session and the one in this page have the same state.
import type { Signal } from "@preact/signals";
import type { Standing } from "../worker/standing";

export function ServerBadge({ agreement }: { agreement: Signal<Standing> }) {
  const now = agreement.value;
  return (
    <p class={`badge badge-${now.kind}`} data-agreement={now.kind} role="status">
      <span class="badge-dot" aria-hidden="true" />
      <span>{agreementText(now)}</span>
    </p>
  );
}

export function agreementText(now: Standing): string {
  switch (now.kind) {
    case "connecting":
      return "Reaching the server";
    case "agrees":
      return now.cycle === 0
        ? "Server agrees on the start"
        : `Server agrees at cycle ${now.cycle.toLocaleString("en")}`;
    case "differs":
      return `Server differs at cycle ${now.cycle.toLocaleString("en")}; its result counts`;
    case "not_compared":
      return "Server follows the bit; not compared";
    case "offline":
      return `Offline, local only: ${now.reason}`;
  }
}
