// What the server has not answered yet: kept until it does, so that a line that breaks loses nothing.
import type { Batch } from "./drill_loop";

/** Poses: a minute and some at 1 kHz. No longer than a minute does the server hold the session of who is gone. */
export const kMostUnanswered = 65_536;

/** Of this page's own session. */
export interface State {
  cycle: number;
  hash: string;
}

/** How many numbers `a` is past `b`, modulo 2^32; negative when it is before. */
function past(a: number, b: number): number {
  return (a - b) | 0;
}
function endOf(batch: Batch): number {
  return (batch.first_seq + batch.poses.length) >>> 0;
}

export class Outbox {
  private held: Batch[] = [];
  private poses = 0;
  /** The last batch that went out of here, and the number of the pose after it. */
  private gone: { end: number; state: State };

  constructor(start: State) {
    this.gone = { end: 0, state: start };
  }

  get batches(): readonly Batch[] {
    return this.held;
  }

  /** False when too much waits already. @pre the batch goes on from the one before. */
  add(batch: Batch): boolean {
    if (this.poses + batch.poses.length > kMostUnanswered) return false;
    this.poses += batch.poses.length;
    this.held.push(batch);
    return true;
  }

  /** All poses up to `seq` are answered. @returns the state after that one, when a batch that waited ends with it. */
  answered(seq: number): State | null {
    const before = this.held.length;
    const state = this.dropUpTo((seq + 1) >>> 0);
    return this.held.length < before ? state : null;
  }

  /**
   * Forgets what the server has taken, when `next` is the pose that it asks for; a batch that it has only in part is cut.
   * @returns null when it asks for what is not here, sent long ago or never made; else the state before that pose,
   * which is known between batches alone.
   */
  resume(next: number): { state: State | null } | null {
    const state = this.dropUpTo(next);
    const first = this.held[0];
    if (!first) return state ? { state } : null;
    const taken = past(next, first.first_seq);
    if (taken < 0) return null;
    if (taken > 0) {
      this.held[0] = { ...first, first_seq: next, poses: first.poses.slice(taken) };
      this.poses -= taken;
    }
    return { state };
  }

  clear(): void {
    this.held = [];
    this.poses = 0;
  }

  /** Batches that end before the pose `next`, or just there; the state there, if one did. */
  private dropUpTo(next: number): State | null {
    const kept = this.held.findIndex((batch) => past(next, endOf(batch)) < 0);
    for (const batch of this.held.splice(0, kept < 0 ? this.held.length : kept)) {
      this.poses -= batch.poses.length;
      this.gone = { end: endOf(batch), state: { cycle: batch.cycle, hash: batch.hash } };
    }
    return this.gone.end === next ? this.gone.state : null;
  }
}
