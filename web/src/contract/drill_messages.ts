// The messages of /ws/drill/{session}, both ways. Contract: server/contract/haptics.md (normative), with golden bytes
// that this file's tests and the C++ tests both read.

import type { Vec3 } from "./bodies";
import { ByteReader, ByteWriter, hashText } from "./bytes";

export const kVersion = 2;
export const kMaxPosesPerBatch = 4096;

export interface Pose {
  t_us: number;
  /** mm, path frame. */
  tip: Vec3;
  /** From shank to tip, path frame. */
  axis: Vec3;
  spinning: boolean;
}

/** 0 or absent where the contract says that it is not known. */
export interface Hello {
  type: "hello";
  role: "drive" | "watch";
  /** Without a coupling between hand and bit. */
  rigid: boolean;
  /** Of feedback; 0 without a limit. */
  max_rate_hz: number;
  max_force_N: number;
  max_stiffness_N_mm: number;
  damping_N_s_mm: number;
  device_rate_hz: number;
  /** Who resumes a session names its token, 16 bytes; a secret. */
  token: Uint8Array | null;
}

export type ClientMessage = Hello | { type: "poses"; first_seq: number; poses: Pose[] } | { type: "finish" };

export interface Feedback {
  type: "feedback";
  /** Of the last pose answered: one message may answer several batches. */
  seq: number;
  t_us: number;
  status: number;
  behind: boolean;
  limited: boolean;
  cycle: number;
  removed_total: number;
  /** Tool frame, scaled for the device. */
  force_N: Vec3;
  torque_Nmm: Vec3;
  force_patient_N: Vec3;
  /** Of the bit, path frame. */
  tip: Vec3;
  axis: Vec3;
  depth_mm: number;
  /** Neither scaled nor limited. */
  thrust_N: number;
  local: LocalModel;
  /** Every so many cycles (welcome's hash_every). */
  state_hash: string | null;
}

export interface LocalModel {
  frontal_mm2: Float32Array;
  rubbing_mm2: number;
  side_mm2: Float32Array;
  side_lever: Float32Array;
}

export const kStatusCodes = ["paused", "resumed", "overload", "watcher joined", "watcher left"] as const;

export type ServerMessage =
  | {
      type: "welcome";
      realtime: boolean;
      state_hash: string;
      points_alive: number;
      token: Uint8Array;
      next_seq: number;
      stiffness_N_mm: number;
      damping_N_s_mm: number;
      force_scale: number;
      hash_every: number;
    }
  | Feedback
  | { type: "finished"; recording_id: string; metrics_json: string }
  | { type: "refused"; reason: string }
  | { type: "status"; code: (typeof kStatusCodes)[number]; text: string };

const kHello = 1;
const kPoses = 2;
const kFinish = 3;
const kWelcome = 129;
const kFeedback = 130;
const kFinished = 131;
const kRefused = 132;
const kStatus = 133;
const kTokenBytes = 16;

/** @pre a batch holds 1 .. kMaxPosesPerBatch poses. */
export function encodeClientMessage(message: ClientMessage): Uint8Array<ArrayBuffer> {
  const writer = new ByteWriter(message.type === "poses" ? 8 + 57 * message.poses.length : 52);
  switch (message.type) {
    case "hello":
      writeHello(writer, message);
      break;
    case "poses":
      writer.u8(kPoses);
      writer.u8(kVersion);
      writer.u32(message.first_seq);
      writer.u16(message.poses.length);
      for (const pose of message.poses) writePose(writer, pose);
      break;
    case "finish":
      writer.u8(kFinish);
      writer.u8(kVersion);
      break;
  }
  return writer.bytes();
}

function writeHello(writer: ByteWriter, hello: Hello): void {
  writer.u8(kHello);
  writer.u8(kVersion);
  writer.u8(hello.role === "watch" ? 1 : 0);
  writer.u8((hello.token ? 1 : 0) | (hello.rigid ? 2 : 0));
  writer.u32(hello.max_rate_hz);
  writer.f64(hello.max_force_N);
  writer.f64(hello.max_stiffness_N_mm);
  writer.f64(hello.damping_N_s_mm);
  writer.u32(hello.device_rate_hz);
  for (let i = 0; i < kTokenBytes; ++i) writer.u8(hello.token?.[i] ?? 0);
}

function writePose(writer: ByteWriter, pose: Pose): void {
  writer.u64(BigInt(pose.t_us));
  for (const v of pose.tip) writer.f64(v);
  for (const v of pose.axis) writer.f64(v);
  writer.u8(pose.spinning ? 1 : 0);
}

/** @throws ContractError for an unknown type or version, a wrong length. */
export function decodeClientMessage(bytes: Uint8Array): ClientMessage {
  const reader = new ByteReader(bytes, "drill message");
  const type = reader.u8();
  checkVersion(reader);
  const message = readClientMessage(reader, type);
  reader.end();
  return message;
}

function readClientMessage(reader: ByteReader, type: number): ClientMessage {
  if (type === kHello) return readHello(reader);
  if (type === kFinish) return { type: "finish" };
  if (type !== kPoses) throw reader.error(`unknown type ${type}`);
  const first_seq = reader.u32();
  const count = reader.u16();
  if (count < 1 || count > kMaxPosesPerBatch) throw reader.error(`a batch of ${count} poses`);
  const poses: Pose[] = [];
  for (let i = 0; i < count; ++i) poses.push(readPose(reader));
  return { type: "poses", first_seq, poses };
}

function readHello(reader: ByteReader): Hello {
  const role = reader.u8();
  const flags = reader.u8();
  const max_rate_hz = reader.u32();
  const numbers = [reader.f64(), reader.f64(), reader.f64()] as const;
  const device_rate_hz = reader.u32();
  const token = readToken(reader);
  const resumes = (flags & 1) !== 0;
  if (role > 1) throw reader.error("hello: an unknown role");
  if (flags > 3) throw reader.error("hello: reserved flags");
  if (!numbers.every((v) => Number.isFinite(v) && v >= 0))
    throw reader.error("hello: a number that is not from 0 on");
  if (resumes && role === 1) throw reader.error("hello: who watches has nothing to resume");
  if (!resumes && token.some((v) => v !== 0)) throw reader.error("hello: a token that resumes nothing");
  return {
    type: "hello",
    role: role === 1 ? "watch" : "drive",
    rigid: (flags & 2) !== 0,
    max_rate_hz,
    max_force_N: numbers[0],
    max_stiffness_N_mm: numbers[1],
    damping_N_s_mm: numbers[2],
    device_rate_hz,
    token: resumes ? token : null,
  };
}

function readToken(reader: ByteReader): Uint8Array {
  return Uint8Array.from({ length: kTokenBytes }, () => reader.u8());
}

function readPose(reader: ByteReader): Pose {
  const pose = { t_us: Number(reader.u64()), tip: reader.vec3(), axis: reader.vec3() };
  const flags = reader.u8();
  if (flags > 1) throw reader.error("a reserved flag is set");
  return { ...pose, spinning: flags === 1 };
}

/** @throws ContractError for an unknown type or version, a wrong length. */
export function decodeServerMessage(bytes: Uint8Array): ServerMessage {
  const reader = new ByteReader(bytes, "drill message");
  const type = reader.u8();
  checkVersion(reader);
  const message = readServerMessage(reader, type);
  reader.end();
  return message;
}

function readServerMessage(reader: ByteReader, type: number): ServerMessage {
  switch (type) {
    case kWelcome:
      return readWelcome(reader);
    case kFeedback:
      return readFeedback(reader);
    case kFinished:
      return { type: "finished", recording_id: reader.text(), metrics_json: reader.text() };
    case kRefused:
      return { type: "refused", reason: reader.text() };
    case kStatus:
      return readStatus(reader);
    default:
      throw reader.error(`unknown type ${type}`);
  }
}

function readWelcome(reader: ByteReader): ServerMessage {
  const flags = reader.u8();
  if (flags > 1) throw reader.error("welcome: reserved flags");
  return {
    type: "welcome",
    realtime: flags === 1,
    state_hash: hashText(reader.u64()),
    points_alive: reader.u32(),
    token: readToken(reader),
    next_seq: reader.u32(),
    stiffness_N_mm: reader.f64(),
    damping_N_s_mm: reader.f64(),
    force_scale: reader.f64(),
    hash_every: reader.u32(),
  };
}

function readFeedback(reader: ByteReader): Feedback {
  const seq = reader.u32();
  const t_us = Number(reader.u64());
  const status = reader.u8();
  const flags = reader.u8();
  if (status > 3) throw reader.error("feedback: an unknown status");
  if (flags > 7) throw reader.error("feedback: reserved flags");
  const message = {
    type: "feedback",
    seq,
    t_us,
    status,
    behind: (flags & 1) !== 0,
    limited: (flags & 2) !== 0,
    cycle: Number(reader.u64()),
    removed_total: Number(reader.u64()),
    force_N: reader.vec3(),
    torque_Nmm: reader.vec3(),
    force_patient_N: reader.vec3(),
    tip: reader.vec3(),
    axis: reader.vec3(),
    depth_mm: reader.f64(),
    thrust_N: reader.f64(),
    local: readLocalModel(reader),
  } as const;
  const hash = reader.u64();
  const has_hash = (flags & 4) !== 0;
  if (!has_hash && hash !== 0n) throw reader.error("feedback: a hash that its flags deny");
  return { ...message, state_hash: has_hash ? hashText(hash) : null };
}

function readLocalModel(reader: ByteReader): LocalModel {
  return {
    frontal_mm2: reader.f32Array(5),
    rubbing_mm2: reader.f32Array(1)[0]!,
    side_mm2: reader.f32Array(8),
    side_lever: reader.f32Array(8),
  };
}

function readStatus(reader: ByteReader): ServerMessage {
  const code = kStatusCodes[reader.u8() - 1];
  if (code === undefined) throw reader.error("status: an unknown code");
  return { type: "status", code, text: reader.text() };
}

function checkVersion(reader: ByteReader): void {
  const version = reader.u8();
  if (version === 1) throw reader.error("protocol version 1 is no longer spoken");
  if (version !== kVersion) throw reader.error(`version ${version} is not known to this page`);
}
