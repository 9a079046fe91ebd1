import { decodeClientMessage } from "@web/contract/drill_messages";
import type { CoreSession, StepOutput } from "@web/worker/core_api";
import { DrillLoop } from "@web/worker/drill_loop";
import { kStill } from "@web/worker/motion";
import { type Agreement, ServerLink } from "@web/worker/server_link";
import { describe, expect, test } from "vitest";

/** Counts cycles; its hash is the count. */
class CountingSession implements CoreSession {
  steps: number[][] = [];
  step(...input: [number, number, number, number, number, number, number, boolean]): StepOutput {
    this.steps.push(input.slice(0, 7) as number[]);
    return {
      status: 0,
      cycle: this.steps.length,
      removed: 0,
      removed_total: 0,
      thrust_N: 0,
      depth_mm: input[3],
    };
  }
  stateHash = () => String(this.steps.length).padStart(16, "0");
  points = () => 0;
  aliveBits = () => new Uint32Array();
  takeSplats = () => new Float32Array();
  takeSplatIndices = () => new Uint32Array();
  takeHidden = () => new Uint32Array();
  recordingBytes = () => new Uint8Array();
  metricsJson = () => "{}";
  delete(): void {}
}

describe("the live loop", () => {
  test("runs a cycle a millisecond while the bit moves, with a clock that never falls", () => {
    const session = new CountingSession();
    const loop = new DrillLoop(session, 0, 50);
    loop.steer({ ...kStill, advance: 1 });
    for (let ms = 0; ms <= 200; ms += 4.3) loop.advanceTo(ms);
    expect(session.steps.length).toBeGreaterThanOrEqual(196);
    expect(session.steps.length).toBeLessThanOrEqual(200);
    session.steps.forEach(
      (step, i) => void (i > 0 && expect(step[0]).toBeGreaterThan(session.steps[i - 1]![0]!)),
    );
  });

  test("makes up a stall only in part", () => {
    const session = new CountingSession();
    const loop = new DrillLoop(session, 0, 50);
    loop.steer({ ...kStill, advance: 1 });
    loop.advanceTo(0);
    expect(loop.advanceTo(10_000)).toBe(40);
  });

  test("rests while nothing moves, and time goes on", () => {
    const session = new CountingSession();
    const loop = new DrillLoop(session, 0, 50);
    loop.advanceTo(0);
    loop.advanceTo(10);
    const first = session.steps.length;
    for (let ms = 20; ms <= 1000; ms += 10) loop.advanceTo(ms);
    expect(session.steps.length).toBe(first);
    loop.steer({ ...kStill, advance: 1 });
    loop.advanceTo(1010);
    expect(session.steps.at(-1)![0]).toBeGreaterThan(980_000);
  });

  test("batches hold every cycle once, in order", () => {
    const loop = new DrillLoop(new CountingSession(), 0, 50);
    loop.steer({ ...kStill, advance: 1 });
    loop.advanceTo(0);
    loop.advanceTo(10);
    const a = loop.takeBatch()!;
    loop.advanceTo(25);
    const b = loop.takeBatch()!;
    expect([a.first_seq, a.poses.length, a.cycle]).toEqual([0, 10, 10]);
    expect([b.first_seq, b.poses.length, b.cycle]).toEqual([10, 15, 25]);
    expect(loop.takeBatch()).toBeNull();
  });
});

function feedback(seq: number, cycle: number, hash: bigint | null): Uint8Array {
  const bytes = new Uint8Array(264);
  const view = new DataView(bytes.buffer);
  bytes.set([130, 2]);
  view.setUint32(2, seq, true);
  view.setUint8(15, hash === null ? 0 : 4);
  view.setBigUint64(16, BigInt(cycle), true);
  view.setBigUint64(256, hash ?? 0n, true);
  return bytes;
}
function welcome(hash: bigint): Uint8Array {
  const bytes = new Uint8Array(63);
  bytes.set([129, 2]);
  new DataView(bytes.buffer).setBigUint64(3, hash, true);
  return bytes;
}
const batch = (first_seq: number, cycle: number, hash: string) => ({
  first_seq,
  cycle,
  hash,
  poses: [
    {
      t_us: cycle * 1000,
      tip: [0, 0, 0] as [number, number, number],
      axis: [0, 0, 1] as [number, number, number],
      spinning: true,
    },
  ],
});

function makeLink() {
  const sent: Uint8Array[] = [];
  const said: Agreement[] = [];
  const finished: string[] = [];
  const wire = { send: (bytes: Uint8Array<ArrayBuffer>) => void sent.push(bytes), close: () => {} };
  const events = {
    agreement: (agreement: Agreement) => void said.push(agreement),
    finished: (id: string) => void finished.push(id),
  };
  return { link: new ServerLink(wire, "0000000000000007", events), sent, said, finished };
}

describe("the line to the server", () => {
  test("says hello, waits for the welcome, then sends what it held", () => {
    const { link, sent } = makeLink();
    link.opened();
    link.send(batch(0, 1, "00000000000000aa"));
    expect(sent.length).toBe(1);
    link.received(welcome(7n));
    expect(sent.map((bytes) => decodeClientMessage(bytes).type)).toEqual(["hello", "poses"]);
    expect(decodeClientMessage(sent[0]!)).toMatchObject({ role: "drive", rigid: true, token: null });
  });

  test("agrees when the hashes of the same cycle are equal", () => {
    const { link, said } = makeLink();
    link.received(welcome(7n));
    link.send(batch(0, 1, "00000000000000aa"));
    link.send(batch(1, 2, "00000000000000bb"));
    link.received(feedback(0, 1, 0xaan));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 1, behind: 1 });
  });

  test("an answer to several batches at once, without a hash, agrees by its cycles", () => {
    const { link, said } = makeLink();
    link.received(welcome(7n));
    link.send(batch(0, 1, "00000000000000aa"));
    link.send(batch(1, 2, "00000000000000bb"));
    link.received(feedback(1, 2, null));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 2, behind: 0 });
    link.received(Uint8Array.from([133, 2, 4, 0, 0, 0, 0]));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 2, behind: 0 });
  });

  test("a differing hash, start state or cycle count is said once and stays said", () => {
    for (const wrong of [feedback(0, 1, 0xabn), feedback(0, 3, 0xaan)]) {
      const { link, said } = makeLink();
      link.received(welcome(7n));
      link.send(batch(0, 1, "00000000000000aa"));
      link.received(wrong);
      link.send(batch(1, 2, "00000000000000bb"));
      link.received(feedback(1, 2, 0xbbn));
      expect(said.at(-1)).toEqual({ kind: "differs", cycle: 1 });
    }
    const { link, said } = makeLink();
    link.received(welcome(8n));
    expect(said).toEqual([{ kind: "differs", cycle: 0 }]);
  });

  test("a refusal, rubbish or a broken line means offline, with the reason", () => {
    const { link, said } = makeLink();
    link.received(Uint8Array.from([99, 2]));
    expect(said.at(-1)).toMatchObject({ kind: "offline" });
    const other = makeLink();
    other.link.lost("the line to the server closed");
    expect(other.said.at(-1)).toEqual({ kind: "offline", reason: "the line to the server closed" });
    expect(other.link.offline).toBe(true);
  });
});
