// What the page says of the server's session. Hashes can be equal only where both sessions couple hand and bit alike.
import type { Agreement } from "./server_link";

export type Standing = Agreement | { kind: "not_compared" };

/**
 * How stiffly the server's session couples hand and bit; 0: rigidly, as this page's hello asks, since it sends where the
 * bit was and not where the hand was. Asked for a stiffness, the welcome says which; that belongs here then.
 */
export const kServerStiffness_N_mm: number = 0;

/** Nothing is claimed of two sessions that were bound to differ. */
export function standingOf(agreement: Agreement, coupled_alike: boolean): Standing {
  const compares = agreement.kind === "agrees" || agreement.kind === "differs";
  return compares && !coupled_alike ? { kind: "not_compared" } : agreement;
}
