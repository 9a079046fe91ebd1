// The worker: holds the core, runs the drill's live loop or a replay, and answers the page.
import type { CoreHand, CorePlayer, CoreSession, PlayerPose } from "./core_api";
import { DrillLoop } from "./drill_loop";
import { loadCore } from "./load_core";
import type { FromWorker, OpenDrill, ToWorker } from "./messages";
import { kGrip } from "./motion";
import { type Dial, ServerLink } from "./server_link";

const kTick_ms = 4;
const kFrame_ms = 16;
const kAlive_ms = 100;

let session: CoreSession | null = null;
let hand: CoreHand | null = null;
let loop: DrillLoop | null = null;
let link: ServerLink | null = null;
let player: CorePlayer | null = null;
let timer = 0;
let frame_due_ms = 0;
let sent = { cycle: -1, rate_hz: -1 };
let shown = true;
/** While the page shows a section: when to send which points are left, and how many were gone the last time. */
const watch = { on: false, due_ms: 0, removed: -1 };

function say(message: FromWorker, transfer: Transferable[] = []): void {
  self.postMessage(message, { transfer });
}

function fail(error: unknown): void {
  say({ type: "failed", message: error instanceof Error ? error.message : String(error) });
}

async function openDrill(request: OpenDrill): Promise<void> {
  const core = await loadCore();
  session = new core.Session(request.point_volume, request.config_json);
  hand = new core.Hand(kGrip.mass_kg, kGrip.damping_N_s_mm, kGrip.across_N_mm);
  loop = new DrillLoop(session, hand, request.lead_mm, request.reach_mm);
  say({ type: "drill_open", points: session.points() });
  if (request.socket_url === null) {
    say({ type: "agreement", agreement: { kind: "offline", reason: request.offline_reason } });
  } else {
    link = connect(request.socket_url, session.stateHash(), request.stiffness_N_mm);
  }
  sendFrame();
  timer = self.setInterval(tick, kTick_ms);
}

function connect(url: string, start_hash: string, stiffness_N_mm: number): ServerLink {
  const dial: Dial = ({ opened, received, ended }) => {
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = opened;
    socket.onmessage = (event) => received(new Uint8Array(event.data as ArrayBuffer));
    socket.onclose = (event) => ended(event.reason || "the line to the server closed");
    return socket;
  };
  const made = new ServerLink(dial, start_hash, stiffness_N_mm, {
    agreement(agreement) {
      say({ type: "agreement", agreement });
      if (agreement.kind === "offline" && finishing) endDrill(null, null);
    },
    finished: (recording_id, metrics_json) => endDrill(recording_id, metrics_json),
  });
  made.connect();
  return made;
}

function tick(): void {
  try {
    const now = performance.now();
    loop!.advanceTo(now);
    if (now < frame_due_ms) return;
    frame_due_ms = now + kFrame_ms;
    sendBatch();
    if (!shown) return;
    sendFrame();
    sendAlive(now);
  } catch (error) {
    self.clearInterval(timer);
    fail(error);
  }
}

function sendBatch(): void {
  const batch = loop!.takeBatch();
  if (batch) link?.send(batch);
}

function sendFrame(): void {
  // While nothing moves there is nothing to draw.
  const readings = loop!.readings();
  if (readings.cycle === sent.cycle && readings.rate_hz === sent.rate_hz) return;
  sent = readings;
  shown = false;
  const rows = session!.takeSplats();
  const indices = session!.takeSplatIndices();
  const hidden = session!.takeHidden();
  const trace = loop!.takeTrace();
  const message = {
    type: "frame",
    readings,
    splats: { rows, indices, hidden },
    trace,
  } as const;
  say(message, [rows.buffer, indices.buffer, hidden.buffer, trace.buffer]);
}

function sendAlive(now: number): void {
  const removed = loop!.readings().removed;
  if (!watch.on || now < watch.due_ms || removed === watch.removed) return;
  watch.due_ms = now + kAlive_ms;
  watch.removed = removed;
  const alive = session!.aliveBits();
  say({ type: "alive", alive }, [alive.buffer]);
}

let finishing = false;

function finishDrill(): void {
  if (!loop || finishing) return;
  self.clearInterval(timer);
  sendBatch();
  sendFrame();
  finishing = true;
  if (link && !link.offline) link.finish();
  else endDrill(null, null);
}

function endDrill(recording_id: string | null, metrics_json: string | null): void {
  if (!session) return;
  const recording = recording_id === null ? session.recordingBytes() : null;
  const own_metrics = session.metricsJson();
  session.delete();
  hand?.delete();
  session = null;
  hand = null;
  loop = null;
  say({ type: "drill_finished", recording_id, metrics_json: metrics_json ?? own_metrics, recording });
}

async function openReplay(recording: Uint8Array, verify_only: boolean): Promise<void> {
  const core = await loadCore();
  player = new core.Player(recording);
  if (verify_only) {
    say({ type: "verdict", verdict: player.verify() });
    return;
  }
  const cycles = player.cycles();
  const stride = Math.max(1, Math.floor(cycles / 2000));
  const series = player.series(stride);
  say({ type: "replay_open", cycles, header_json: player.headerJson(), series, stride });
}

/** Before anything was recorded the bit stands at the entry. */
const kNoPose: PlayerPose = {
  t_us: 0,
  tip: [0, 0, 0],
  axis: [0, 0, 1],
  thrust_N: 0,
  depth_mm: 0,
  removed_total: 0,
};

function seek(cycle: number): void {
  player!.seek(cycle);
  const pose = player!.poseAt(cycle) ?? kNoPose;
  const splats = player!.splats();
  const alive = player!.aliveBits();
  say({ type: "moment", cycle, pose, splats, alive }, [splats.buffer, alive.buffer]);
}

async function handle(message: ToWorker): Promise<void> {
  switch (message.type) {
    case "open_drill":
      return openDrill(message);
    case "steer":
      return loop?.steer(message.steering);
    case "nudge":
      return loop?.nudge(message.across);
    case "wheel":
      return loop?.wheel(message.push_N);
    case "shown":
      shown = true;
      return;
    case "watch_alive":
      watch.on = message.on;
      watch.removed = -1;
      return;
    case "finish_drill":
      return finishDrill();
    case "finish_alone":
      return link?.giveUp("it was not waited for");
    case "open_replay":
      return openReplay(message.recording, message.verify_only);
    case "seek":
      return seek(message.cycle);
    case "run_scene": {
      const core = await loadCore();
      const result = core.runScene(message.name, message.engine, message.cycles, message.discs);
      return say({ type: "scene", result });
    }
  }
}

self.onmessage = (event: MessageEvent<ToWorker>) => {
  handle(event.data).catch(fail);
};
