// The line to the server's session: sends batches of the hand's poses, compares the server's state hash with ours at the
// same cycle.
import { decodeServerMessage, encodeClientMessage, type Hello } from "../contract/drill_messages";
import type { Batch } from "./drill_loop";

export type Agreement =
  | { kind: "connecting" }
  /** As of the last cycle whose hash the server has sent. */
  | { kind: "agrees"; cycle: number }
  | { kind: "differs"; cycle: number }
  /** The server couples hand and bit otherwise than this page: the two are bound to differ. */
  | { kind: "not_compared" }
  | { kind: "offline"; reason: string };

export interface LinkEvents {
  agreement(agreement: Agreement): void;
  finished(recording_id: string, metrics_json: string): void;
}

/** What a WebSocket is used for here; a test gives its own. */
export interface Wire {
  send(bytes: Uint8Array<ArrayBuffer>): void;
  close(): void;
}

export class ServerLink {
  private expected = new Map<number, { cycle: number; hash: string }>();
  private state: Agreement = { kind: "connecting" };
  private waiting: Uint8Array<ArrayBuffer>[] = [];
  private welcomed = false;
  private over = false;

  /** @param stiffness_N_mm of this page's own coupling between hand and bit, which has no damping. */
  constructor(
    private readonly wire: Wire,
    private readonly start_hash: string,
    private readonly stiffness_N_mm: number,
    private readonly events: LinkEvents,
  ) {}

  opened(): void {
    // No device: of its damping and rate nothing is said, so that no device lowers the stiffness.
    const hello: Hello = {
      type: "hello",
      role: "drive",
      rigid: false,
      max_rate_hz: 0,
      max_force_N: 0,
      max_stiffness_N_mm: this.stiffness_N_mm,
      damping_N_s_mm: 0,
      device_rate_hz: 0,
      token: null,
    };
    this.wire.send(encodeClientMessage(hello));
  }

  send(batch: Batch): void {
    if (this.state.kind === "offline" || this.over) return;
    this.expected.set(batch.first_seq + batch.poses.length - 1, { cycle: batch.cycle, hash: batch.hash });
    this.post(encodeClientMessage({ type: "poses", first_seq: batch.first_seq, poses: batch.poses }));
  }

  finish(): void {
    if (this.state.kind !== "offline") this.post(encodeClientMessage({ type: "finish" }));
  }

  received(bytes: Uint8Array): void {
    try {
      this.handle(bytes);
    } catch (error) {
      this.drop(`the server's answer was not understood: ${(error as Error).message}`);
      this.wire.close();
    }
  }

  /** The line broke or never opened. */
  lost(reason: string): void {
    if (!this.over) this.drop(reason);
  }

  get offline(): boolean {
    return this.state.kind === "offline";
  }

  private post(bytes: Uint8Array<ArrayBuffer>): void {
    if (this.welcomed) this.wire.send(bytes);
    else this.waiting.push(bytes);
  }

  private handle(bytes: Uint8Array): void {
    const message = decodeServerMessage(bytes);
    switch (message.type) {
      case "welcome":
        this.welcomed = true;
        if (message.stiffness_N_mm !== this.stiffness_N_mm || message.damping_N_s_mm !== 0)
          this.say({ kind: "not_compared" });
        this.compare(message.state_hash, { cycle: 0, hash: this.start_hash });
        for (const held of this.waiting) this.wire.send(held);
        this.waiting = [];
        break;
      case "feedback": {
        const ours = this.expected.get(message.seq);
        if (!ours) break;
        for (const seq of this.expected.keys()) if (seq <= message.seq) this.expected.delete(seq);
        this.compare(message.state_hash, ours, message.cycle);
        break;
      }
      case "finished":
        this.over = true;
        this.events.finished(message.recording_id, message.metrics_json);
        break;
      case "refused":
        this.drop(`the server refused: ${message.reason}`);
        break;
      case "status":
        break;
    }
  }

  private compare(theirs: string | null, ours: { cycle: number; hash: string }, cycle = ours.cycle): void {
    // Once they differ they cannot agree again: keep the first cycle at which it was seen.
    if (this.state.kind === "differs" || this.state.kind === "not_compared") return;
    if (cycle !== ours.cycle) this.say({ kind: "differs", cycle: Math.min(cycle, ours.cycle) });
    else if (theirs !== null)
      this.say({ kind: theirs === ours.hash ? "agrees" : "differs", cycle: ours.cycle });
  }

  private drop(reason: string): void {
    this.say({ kind: "offline", reason });
    this.expected.clear();
    this.waiting = [];
  }

  private say(agreement: Agreement): void {
    this.state = agreement;
    this.events.agreement(agreement);
  }
}
