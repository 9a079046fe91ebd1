// One replay as the room sees it: a player in one worker, the verification in another so that the slider stays quick.
import { signal } from "@preact/signals";
import type { PlayerPose, Verdict } from "../worker/core_api";
import type { FromWorker } from "../worker/messages";
import { CoreClient } from "./core_client";
import { SeriesTable } from "./series";

export interface Moment {
  cycle: number;
  pose: PlayerPose;
  splats: Float32Array;
  alive: Uint32Array;
}

export interface Plots {
  thrust_over_depth: number[];
  depth_over_time: number[];
  version: number;
}

export class ReplaySession {
  readonly cycles = signal(0);
  /** The moment asked for; the picture follows as fast as the core can. */
  readonly cycle = signal(0);
  readonly moment = signal<Moment | null>(null);
  readonly plots = signal<Plots | null>(null);
  readonly verdict = signal<Verdict | null>(null);
  readonly trouble = signal<string | null>(null);
  readonly playing = signal(false);
  readonly speed = signal(1);
  private table: SeriesTable | null = null;
  private busy = false;
  private asked = -1;
  private clock = { last_ms: 0, time_s: 0, frame: 0 };
  private readonly player = new CoreClient((message) => this.hear(message));
  private readonly verifier = new CoreClient((message) => this.hear(message));

  constructor(recording: Uint8Array) {
    this.player.tell({ type: "open_replay", recording, verify_only: false });
    this.verifier.tell({ type: "open_replay", recording, verify_only: true });
  }

  close(): void {
    this.pause();
    this.player.close();
    this.verifier.close();
  }

  timeAt(cycle: number): number {
    return this.table?.timeAt(cycle) ?? 0;
  }

  seek(cycle: number): void {
    this.cycle.value = Math.max(0, Math.min(this.cycles.value, Math.round(cycle)));
    this.clock.time_s = this.timeAt(this.cycle.value);
    this.ask();
  }

  togglePlay(): void {
    if (this.playing.value) {
      this.pause();
      return;
    }
    if (this.cycle.value >= this.cycles.value) this.seek(0);
    this.playing.value = true;
    this.clock.last_ms = performance.now();
    this.clock.frame = requestAnimationFrame((now) => this.play(now));
  }

  private pause(): void {
    this.playing.value = false;
    cancelAnimationFrame(this.clock.frame);
  }

  private play(now: number): void {
    const time_s = this.clock.time_s + (Math.max(0, now - this.clock.last_ms) / 1000) * this.speed.value;
    this.clock.last_ms = now;
    this.seek(this.table!.cycleAt(time_s));
    this.clock.time_s = time_s;
    if (this.cycle.value >= this.cycles.value) this.pause();
    else this.clock.frame = requestAnimationFrame((next) => this.play(next));
  }

  /** One question at a time; the latest wish wins. */
  private ask(): void {
    if (this.busy || this.asked === this.cycle.value) return;
    this.busy = true;
    this.asked = this.cycle.value;
    this.player.tell({ type: "seek", cycle: this.asked });
  }

  private hear(message: FromWorker): void {
    switch (message.type) {
      case "replay_open":
        this.table = new SeriesTable(message.series, message.cycles, message.stride);
        this.cycles.value = message.cycles;
        this.plots.value = { ...this.table.plots(), version: 1 };
        this.seek(message.cycles);
        break;
      case "moment":
        this.busy = false;
        this.moment.value = message;
        this.ask();
        break;
      case "verdict":
        this.verdict.value = message.verdict;
        this.verifier.close();
        break;
      case "failed":
        this.trouble.value = message.message;
        break;
    }
  }
}
