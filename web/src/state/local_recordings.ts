// A drill that the server could not keep lives in this page until it is closed, and can be replayed from here.
import type { Metrics } from "../contract/rest";

let kept: { case_id: string; bytes: Uint8Array } | null = null;

export function keepLocally(case_id: string, bytes: Uint8Array): void {
  kept = { case_id, bytes };
}
export function keptLocally(case_id: string): Uint8Array | null {
  return kept?.case_id === case_id ? kept.bytes : null;
}

/** @returns null when the text is not a JSON object. */
export function parseMetrics(text: string | null): Metrics | null {
  if (text === null) return null;
  try {
    const value: unknown = JSON.parse(text);
    return typeof value === "object" && value !== null ? (value as Metrics) : null;
  } catch {
    return null;
  }
}
