// The messages of /ws/drill/{session}, both ways. Contract: server/contract/haptics.md (normative), with golden bytes
// that this file's tests and the C++ tests both read.

import type { Vec3 } from "./bodies";
import { ByteReader, ByteWriter, hashText } from "./bytes";

export const kVersion = 1;
export const kMaxPosesPerBatch = 4096;

export interface Pose {
  t_us: number;
  /** mm, path frame. */
  tip: Vec3;
  /** From shank to tip, path frame. */
  axis: Vec3;
  spinning: boolean;
}

export type ClientMessage =
  | { type: "hello"; max_rate_hz: number }
  | { type: "poses"; first_seq: number; poses: Pose[] }
  | { type: "finish" };

export type ServerMessage =
  | { type: "welcome"; state_hash: string; points_alive: number }
  | {
      type: "feedback";
      seq: number;
      status: number;
      cycle: number;
      removed_total: number;
      thrust_N: number;
      depth_mm: number;
      state_hash: string;
    }
  | { type: "finished"; recording_id: string; metrics_json: string }
  | { type: "refused"; reason: string };

const kHello = 1;
const kPoses = 2;
const kFinish = 3;
const kWelcome = 129;
const kFeedback = 130;
const kFinished = 131;
const kRefused = 132;

/** @pre a batch holds 1 .. kMaxPosesPerBatch poses. */
export function encodeClientMessage(message: ClientMessage): Uint8Array<ArrayBuffer> {
  const writer = new ByteWriter(message.type === "poses" ? 8 + 57 * message.poses.length : 8);
  switch (message.type) {
    case "hello":
      writer.u8(kHello);
      writer.u8(kVersion);
      writer.u32(message.max_rate_hz);
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
  if (type === kHello) return { type: "hello", max_rate_hz: reader.u32() };
  if (type === kFinish) return { type: "finish" };
  if (type !== kPoses) throw reader.error(`unknown type ${type}`);
  const first_seq = reader.u32();
  const count = reader.u16();
  if (count < 1 || count > kMaxPosesPerBatch) throw reader.error(`a batch of ${count} poses`);
  const poses: Pose[] = [];
  for (let i = 0; i < count; ++i) poses.push(readPose(reader));
  return { type: "poses", first_seq, poses };
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
      return { type: "welcome", state_hash: hashText(reader.u64()), points_alive: reader.u32() };
    case kFeedback:
      return {
        type: "feedback",
        seq: reader.u32(),
        status: reader.u8(),
        cycle: Number(reader.u64()),
        removed_total: Number(reader.u64()),
        thrust_N: reader.f64(),
        depth_mm: reader.f64(),
        state_hash: hashText(reader.u64()),
      };
    case kFinished:
      return { type: "finished", recording_id: reader.text(), metrics_json: reader.text() };
    case kRefused:
      return { type: "refused", reason: reader.text() };
    default:
      throw reader.error(`unknown type ${type}`);
  }
}

function checkVersion(reader: ByteReader): void {
  const version = reader.u8();
  if (version !== kVersion) throw reader.error(`version ${version} is not known to this page`);
}
