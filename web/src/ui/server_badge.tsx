// Whether the server's session and the one in this page have the same state.
import type { Signal } from "@preact/signals";
import type { Agreement } from "../worker/server_link";

export function ServerBadge({ agreement }: { agreement: Signal<Agreement> }) {
  const now = agreement.value;
  return (
    <p class={`badge badge-${now.kind}`} data-agreement={now.kind} role="status">
      <span class="badge-dot" aria-hidden="true" />
      <span>{agreementText(now)}</span>
    </p>
  );
}

export function agreementText(now: Agreement): string {
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
      return "Server holds the bit otherwise; not compared";
    case "reconnecting":
      return "Reconnecting to the server";
    case "offline":
      return `Offline, local only: ${now.reason}`;
  }
}
