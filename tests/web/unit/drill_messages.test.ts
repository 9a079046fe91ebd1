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

describe("drill messages", () => {
  test("the client's messages have the golden bytes", () => {
    expect(encodeClientMessage({ type: "hello", max_rate_hz: 1000 })).toEqual(goldenBytes("hello.hex"));
    expect(encodeClientMessage({ type: "finish" })).toEqual(goldenBytes("finish.hex"));
    // JavaScript has one NaN; the golden one carries a payload in its lowest byte, at the second pose's tip.x.
    const golden = goldenBytes("poses.hex");
    golden[8 + 57 + 8] = 0;
    expect(encodeClientMessage(poses)).toEqual(golden);
  });

  test("the client's golden bytes are read back, NaN and minus zero included", () => {
    expect(decodeClientMessage(goldenBytes("hello.hex"))).toEqual({ type: "hello", max_rate_hz: 1000 });
    const read = decodeClientMessage(goldenBytes("poses.hex"));
    expect(read).toEqual(poses);
    expect(read.type === "poses" && Object.is(read.poses[1]!.tip[2], -0)).toBe(true);
  });

  test("the server's golden bytes are read", () => {
    expect(decodeServerMessage(goldenBytes("welcome.hex"))).toEqual({
      type: "welcome",
      state_hash: "0123456789abcdef",
      points_alive: 986958,
    });
    expect(decodeServerMessage(goldenBytes("feedback.hex"))).toEqual({
      type: "feedback",
      seq: 43,
      status: 1,
      cycle: 1001,
      removed_total: 12345,
      thrust_N: 4.5,
      depth_mm: -0.125,
      state_hash: "fedcba9876543210",
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
  ])("%s is refused in either direction", (name) => {
    expect(() => decodeClientMessage(goldenBytes(name))).toThrow(/drill message/);
    expect(() => decodeServerMessage(goldenBytes(name))).toThrow(/drill message/);
  });

  test("a message cut at any byte is refused", () => {
    for (const name of ["welcome.hex", "feedback.hex", "finished.hex", "refused.hex"]) {
      const whole = goldenBytes(name);
      for (let length = 0; length < whole.length; ++length) {
        expect(() => decodeServerMessage(whole.subarray(0, length))).toThrow(/drill message/);
      }
    }
  });
});
