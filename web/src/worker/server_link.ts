// The line to the server's session: sends batches of the hand's poses, and compares the server's state hash with ours at
// the same cycle. A line that breaks is made anew, and goes on where the server was: server/contract/haptics.md.
import { decodeServerMessage, encodeClientMessage, type ServerMessage } from "../contract/drill_messages";
import type { Batch } from "./drill_loop";
import { Outbox, type State } from "./outbox";

export type Agreement =
  | { kind: "connecting" }
  /** As of the last cycle whose hash the server has sent. */
  | { kind: "agrees"; cycle: number }
  | { kind: "differs"; cycle: number }
  /** The server couples hand and bit otherwise than this page: the two are bound to differ. */
  | { kind: "not_compared" }
  /** The line broke; the drill goes on, and nothing is lost so far. */
  | { kind: "reconnecting" }
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
/** What it tells, never before the call that made it has returned. */
export interface WireEvents {
  opened(): void;
  received(bytes: Uint8Array): void;
  /** It broke or never opened. */
  ended(reason: string): void;
}
export type Dial = (events: WireEvents) => Wire;

/** The server holds the session of who is gone so long. */
const kPatience_ms = 60_000;
/** Before the first try to reconnect; twice as long before each further one. */
const kFirstWait_ms = 250;
const kLongestWait_ms = 8000;
/** An answer that is due and does not come means that the line is dead. To keep a recording takes longer. */
const kSilence_ms = 10_000;
const kKeeping_ms = 60_000;

type Timer = ReturnType<typeof setTimeout>;
type Welcome = Extract<ServerMessage, { type: "welcome" }>;

export class ServerLink {
  private readonly outbox: Outbox;
  private wire: Wire | null = null;
  /** Of wires so far: what an earlier one still tells is not heard. */
  private dials = 0;
  private token: Uint8Array | null = null;
  private welcomed = false;
  private finishing = false;
  private over = false;
  /** What comparing has found, whatever becomes of the line. */
  private found: Agreement = { kind: "connecting" };
  private lost_ms: number | null = null;
  private tries = 0;
  private next_try: Timer | undefined;
  private silence: Timer | undefined;

  /** @param stiffness_N_mm of this page's own coupling between hand and bit, which has no damping. */
  constructor(
    private readonly dial: Dial,
    private readonly start_hash: string,
    private readonly stiffness_N_mm: number,
    private readonly events: LinkEvents,
  ) {
    this.outbox = new Outbox({ cycle: 0, hash: start_hash });
  }

  /** Nothing more comes of this line. */
  get offline(): boolean {
    return this.over;
  }

  connect(): void {
    const dial = ++this.dials;
    const heard = (): boolean => dial === this.dials && !this.over;
    this.wire = this.dial({
      opened: () => void (heard() && this.sayHello()),
      received: (bytes) => void (heard() && this.received(bytes)),
      ended: (reason) => void (heard() && this.lost(reason)),
    });
    this.awaitWord();
  }

  send(batch: Batch): void {
    if (this.over) return;
    if (!this.outbox.add(batch)) this.giveUp("the server has not answered for too long");
    if (!this.welcomed) return;
    this.post(batch);
    if (this.silence === undefined) this.awaitWord();
  }

  /** The server's `finished` is told; or that there will be none: offline. */
  finish(): void {
    this.finishing = true;
    if (this.welcomed) this.postFinish();
  }

  giveUp(reason: string): void {
    this.hangUp();
    this.over = true;
    this.outbox.clear();
    this.events.agreement({ kind: "offline", reason });
  }

  private sayHello(): void {
    // No device: of its damping and rate nothing is said, so that no device lowers the stiffness.
    const hello = encodeClientMessage({
      type: "hello",
      role: "drive",
      rigid: false,
      max_rate_hz: 0,
      max_force_N: 0,
      max_stiffness_N_mm: this.stiffness_N_mm,
      damping_N_s_mm: 0,
      device_rate_hz: 0,
      token: this.token,
    });
    this.wire!.send(hello);
  }

  private post({ first_seq, poses }: Batch): void {
    this.wire!.send(encodeClientMessage({ type: "poses", first_seq, poses }));
  }
  private postFinish(): void {
    this.wire!.send(encodeClientMessage({ type: "finish" }));
    this.awaitWord();
  }

  private received(bytes: Uint8Array): void {
    try {
      this.handle(decodeServerMessage(bytes));
      if (!this.over) this.awaitWord();
    } catch (error) {
      this.giveUp(`the server's answer was not understood: ${(error as Error).message}`);
    }
  }

  private handle(message: ServerMessage): void {
    switch (message.type) {
      case "welcome":
        if (this.token === null) this.start(message);
        else this.resume(message);
        break;
      case "feedback": {
        this.tries = 0;
        const ours = this.outbox.answered(message.seq);
        if (ours) this.compare(message.state_hash, ours, message.cycle);
        break;
      }
      case "finished":
        this.hangUp();
        this.over = true;
        this.events.finished(message.recording_id, message.metrics_json);
        break;
      case "refused":
        this.giveUp(`the server refused: ${message.reason}`);
        break;
      case "status":
        break;
    }
  }

  private start(message: Welcome): void {
    this.token = message.token;
    if (message.stiffness_N_mm !== this.stiffness_N_mm || message.damping_N_s_mm !== 0)
      this.find({ kind: "not_compared" });
    this.compare(message.state_hash, { cycle: 0, hash: this.start_hash });
    this.sendWaiting();
  }

  private resume(message: Welcome): void {
    const at = this.outbox.resume(message.next_seq);
    if (!at) {
      this.giveUp("the server's session is not where this drill was");
      return;
    }
    this.events.agreement(this.found);
    if (at.state) this.compare(message.state_hash, at.state);
    this.sendWaiting();
  }

  /** All that the server has not taken, in order. */
  private sendWaiting(): void {
    this.welcomed = true;
    this.lost_ms = null;
    for (const batch of this.outbox.batches) this.post(batch);
    if (this.finishing) this.postFinish();
  }

  private compare(theirs: string | null, ours: State, cycle = ours.cycle): void {
    // Once they differ they cannot agree again: keep the first cycle at which it was seen.
    if (this.found.kind === "differs" || this.found.kind === "not_compared") return;
    if (cycle !== ours.cycle) this.find({ kind: "differs", cycle: Math.min(cycle, ours.cycle) });
    else if (theirs !== null)
      this.find({ kind: theirs === ours.hash ? "agrees" : "differs", cycle: ours.cycle });
  }

  private find(found: Agreement): void {
    this.found = found;
    this.events.agreement(found);
  }

  /** Tries again for as long as the server may hold the session; one that never was welcome has none to resume. */
  private lost(reason: string): void {
    this.hangUp();
    const now = performance.now();
    this.lost_ms ??= now;
    const wait = Math.min(kLongestWait_ms, kFirstWait_ms * 2 ** this.tries++);
    if (this.token === null) {
      this.giveUp(reason);
    } else if (now + wait - this.lost_ms > kPatience_ms) {
      this.giveUp(`${reason}, and could not be made anew`);
    } else {
      this.events.agreement({ kind: "reconnecting" });
      this.next_try = setTimeout(() => this.connect(), wait);
    }
  }

  private hangUp(): void {
    ++this.dials;
    this.welcomed = false;
    clearTimeout(this.next_try);
    this.stopWaiting();
    this.wire?.close();
    this.wire = null;
  }

  /** Watches for silence, where a word from the server is due. */
  private awaitWord(): void {
    this.stopWaiting();
    const due = this.welcomed ? this.finishing || this.outbox.batches.length > 0 : this.token !== null;
    if (!due) return;
    const patience = this.welcomed && this.finishing ? kKeeping_ms : kSilence_ms;
    this.silence = setTimeout(() => this.lost("the server has gone silent"), patience);
  }
  private stopWaiting(): void {
    clearTimeout(this.silence);
    this.silence = undefined;
  }
}
