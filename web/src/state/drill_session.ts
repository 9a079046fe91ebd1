// One drill as the room sees it: signals that the worker's messages move.
import { signal } from "@preact/signals";
import type { PathInfo } from "../contract/rest";
import { kTraceFloats, type Readings } from "../worker/drill_loop";
import type { FromWorker, SplatChange } from "../worker/messages";
import { kStiffness_N_mm, type Steering } from "../worker/motion";
import type { Agreement } from "../worker/server_link";
import { ApiError, createSession, socketUrl } from "./api";
import { CoreClient } from "./core_client";
import { ForceTrace } from "./force_trace";
import { messageOf } from "./load";

export type Phase = "opening" | "drilling" | "finishing" | "finished" | "failed";

export interface Outcome {
  recording_id: string | null;
  metrics_json: string | null;
  /** Where the server has not kept one. */
  recording: Uint8Array | null;
}

export class DrillSession {
  readonly phase = signal<Phase>("opening");
  readonly readings = signal<Readings | null>(null);
  readonly agreement = signal<Agreement>({ kind: "connecting" });
  readonly trouble = signal<string | null>(null);
  readonly outcome = signal<Outcome | null>(null);
  /** Depth, thrust, depth, thrust ... ; the version counts its changes. */
  readonly trace: number[] = [];
  /** The last seconds of push and thrust over time; changes with the same version. */
  readonly forces = new ForceTrace();
  readonly trace_version = signal(0);
  onSplats: ((change: SplatChange) => void) | null = null;
  /** Which points are left, a few times a second while watched. */
  onAlive: ((alive: Uint32Array) => void) | null = null;
  private readonly core = new CoreClient((message) => this.hear(message));

  /** Starts the server's session, or goes on without it, and opens the core. */
  async open(case_id: string, path: PathInfo, point_volume: Uint8Array): Promise<void> {
    let socket_url: string | null = null;
    let offline_reason = "";
    let engine = "clearance";
    try {
      const session = await createSession(case_id, path.id);
      socket_url = socketUrl(session.id);
      engine = session.engine;
    } catch (error) {
      offline_reason = error instanceof ApiError ? error.message : messageOf(error);
    }
    // The speed is the core's own default, here as in the server's session.
    const config = {
      bit: path.bit,
      engine,
      stiffness_N_mm: kStiffness_N_mm,
      case_id,
      path_id: path.id,
      length_mm: path.length_mm,
    };
    this.core.tell({
      type: "open_drill",
      point_volume,
      config_json: JSON.stringify(config),
      stiffness_N_mm: kStiffness_N_mm,
      lead_mm: path.lead_mm,
      reach_mm: path.bit.length_mm,
      socket_url,
      offline_reason,
    });
  }

  steer(steering: Steering): void {
    this.core.tell({ type: "steer", steering });
  }
  nudge(across: [number, number]): void {
    this.core.tell({ type: "nudge", across });
  }
  wheel(push_N: number): void {
    this.core.tell({ type: "wheel", push_N });
  }
  watchAlive(on: boolean): void {
    this.core.tell({ type: "watch_alive", on });
  }
  finish(): void {
    if (this.phase.value !== "drilling") return;
    this.phase.value = "finishing";
    this.core.tell({ type: "finish_drill" });
  }
  /** The server, being out of reach, need not keep it. */
  finishAlone(): void {
    this.core.tell({ type: "finish_alone" });
  }
  close(): void {
    this.core.close();
  }

  private hear(message: FromWorker): void {
    switch (message.type) {
      case "drill_open":
        this.phase.value = "drilling";
        break;
      case "frame":
        this.hearFrame(message);
        break;
      case "alive":
        this.onAlive?.(message.alive);
        break;
      case "agreement":
        this.agreement.value = message.agreement;
        break;
      case "drill_finished":
        this.outcome.value = message;
        this.phase.value = "finished";
        this.core.close();
        break;
      case "failed":
        this.trouble.value = message.message;
        this.phase.value = "failed";
        break;
    }
  }

  private hearFrame(frame: Extract<FromWorker, { type: "frame" }>): void {
    requestAnimationFrame(() => this.core.tell({ type: "shown" }));
    this.readings.value = frame.readings;
    this.onSplats?.(frame.splats);
    const rows = frame.trace;
    if (rows.length === 0) return;
    for (let i = 0; i < rows.length; i += kTraceFloats) this.trace.push(rows[i + 1]!, rows[i + 2]!);
    this.forces.add(rows);
    ++this.trace_version.value;
  }
}
