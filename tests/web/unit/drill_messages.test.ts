import {
  type ClientMessage,
  decodeClientMessage,
  decodeServerMessage,
  encodeClientMessage,
} from "@web/contract/drill_messages";
import { describe, expect, test } from "vitest";
import { goldenBytes } from "./golden";

const poses: ClientMessage = {
  type: "poses",
  first_seq: 42,
  poses: [
    { t_us: 1000, tip: [0.5, -0.25, 10], axis: [0, 0, 1], spinning: true },
    { t_us: 2000, tip: [Number.NaN, Number.POSITIVE_INFINITY, -0], axis: [0, 0, 0], spinning: false },
  ],
};

const token = Uint8Array.from({ length: 16 }, (_, i) => i);
const unknown = {
  max_rate_hz: 0,
  max_force_N: 0,
  max_stiffness_N_mm: 0,
  damping_N_s_mm: 0,
  device_rate_hz: 0,
};
const hellos: [string, ClientMessage][] = [
  [
    "hello.hex",
    {
      type: "hello",
      role: "drive",
      rigid: false,
      max_rate_hz: 1000,
      max_force_N: 3.3,
      max_stiffness_N_mm: 2,
      damping_N_s_mm: 0.005,
      device_rate_hz: 1000,
      token: null,
    },
  ],
  ["hello_resume.hex", { type: "hello", role: "drive", rigid: true, ...unknown, token }],
  [
    "hello_watch.hex",
    { type: "hello", role: "watch", rigid: false, ...unknown, max_rate_hz: 60, token: null },
  ],
];

describe("drill messages", () => {
  test("the client's messages have the golden bytes", () => {
    for (const [name, hello] of hellos) expect(encodeClientMessage(hello)).toEqual(goldenBytes(name));
    expect(encodeClientMessage({ type: "finish" })).toEqual(goldenBytes("finish.hex"));
    // JavaScript has one NaN; the golden one carries a payload in its lowest byte, at the second pose's tip.x.
    const golden = goldenBytes("poses.hex");
    golden[8 + 57 + 8] = 0;
    expect(encodeClientMessage(poses)).toEqual(golden);
  });

  test("the client's golden bytes are read back, NaN and minus zero included", () => {
    for (const [name, hello] of hellos) expect(decodeClientMessage(goldenBytes(name))).toEqual(hello);
    const read = decodeClientMessage(goldenBytes("poses.hex"));
    expect(read).toEqual(poses);
    expect(read.type === "poses" && Object.is(read.poses[1]!.tip[2], -0)).toBe(true);
  });

  test("the server's golden bytes are read", () => {
    expect(decodeServerMessage(goldenBytes("welcome.hex"))).toEqual({
      type: "welcome",
      realtime: true,
      state_hash: "0123456789abcdef",
      points_alive: 986958,
      token,
      next_seq: 43,
      stiffness_N_mm: 2,
      damping_N_s_mm: 0.001,
      force_scale: 0.0825,
      hash_every: 16,
    });
    expect(decodeServerMessage(goldenBytes("feedback.hex"))).toEqual({
      type: "feedback",
      seq: 43,
      t_us: 2000,
      status: 1,
      behind: true,
      limited: true,
      cycle: 1001,
      removed_total: 12345,
      force_N: [0.25, -0.5, -3.25],
      torque_Nmm: [1.5, -2, -18],
      force_patient_N: [-0.5, 0.25, 3.25],
      tip: [0.125, -0.0625, -0.125],
      axis: [0, 0.6, 0.8],
      depth_mm: -0.125,
      thrust_N: 4.5,
      local: {
        frontal_mm2: Float32Array.of(1, 1.5, 2, 2.5, 3),
        rubbing_mm2: 12.5,
        side_mm2: Float32Array.from({ length: 8 }, (_, i) => i / 2),
        side_lever: Float32Array.from({ length: 8 }, (_, i) => i / 8),
      },
      state_hash: "fedcba9876543210",
    });
    expect(decodeServerMessage(goldenBytes("status.hex"))).toEqual({
      type: "status",
      code: "paused",
      text: "the trainee is away",
    });
    expect(decodeServerMessage(goldenBytes("finished.hex"))).toEqual({
      type: "finished",
      recording_id: "r7k2m9xq",
      metrics_json: '{"peak_thrust_N":4.5}',
    });
    expect(decodeServerMessage(goldenBytes("refused.hex"))).toEqual({
      type: "refused",
      reason: "no such session",
    });
  });

  test.each([
    "bad_type.hex",
    "bad_version.hex",
    "bad_flags.hex",
    "bad_count.hex",
    "bad_empty_batch.hex",
    "bad_left_over.hex",
    "bad_short.hex",
    "bad_version_1.hex",
    "bad_hello_role.hex",
    "bad_hello_flags.hex",
    "bad_hello_nan.hex",
    "bad_hello_negative.hex",
    "bad_hello_infinite.hex",
    "bad_hello_token.hex",
    "bad_hello_watch_resume.hex",
    "bad_feedback_flags.hex",
    "bad_feedback_status.hex",
    "bad_feedback_hash.hex",
    "bad_welcome_flags.hex",
    "bad_status_code.hex",
  ])("%s is refused in either direction", (name) => {
    expect(() => decodeClientMessage(goldenBytes(name))).toThrow(/drill message/);
    expect(() => decodeServerMessage(goldenBytes(name))).toThrow(/drill message/);
  });

  test("a message cut at any byte is refused", () => {
    for (const name of ["welcome.hex", "feedback.hex", "finished.hex", "refused.hex", "status.hex"]) {
      const whole = goldenBytes(name);
      for (let length = 0; length < whole.length; ++length) {
        expect(() => decodeServerMessage(whole.subarray(0, length))).toThrow(/drill message/);
      }
    }
  });
});
