import { decodeClientMessage } from "@web/contract/drill_messages";
import { type Agreement, ServerLink } from "@web/worker/server_link";
import { describe, expect, test } from "vitest";

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
function welcome(hash: bigint, coupling = { stiffness_N_mm: 5, damping_N_s_mm: 0 }): Uint8Array {
  const bytes = new Uint8Array(63);
  bytes.set([129, 2]);
  const view = new DataView(bytes.buffer);
  view.setBigUint64(3, hash, true);
  view.setFloat64(35, coupling.stiffness_N_mm, true);
  view.setFloat64(43, coupling.damping_N_s_mm, true);
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
  return { link: new ServerLink(wire, "0000000000000007", 5, events), sent, said, finished };
}

describe("the line to the server", () => {
  test("says hello, waits for the welcome, then sends what it held", () => {
    const { link, sent } = makeLink();
    link.opened();
    link.send(batch(0, 1, "00000000000000aa"));
    expect(sent.length).toBe(1);
    link.received(welcome(7n));
    expect(sent.map((bytes) => decodeClientMessage(bytes).type)).toEqual(["hello", "poses"]);
    expect(decodeClientMessage(sent[0]!)).toMatchObject({
      role: "drive",
      rigid: false,
      max_stiffness_N_mm: 5,
      damping_N_s_mm: 0,
      device_rate_hz: 0,
      token: null,
    });
  });

  test("agrees when the hashes of the same cycle are equal", () => {
    const { link, said } = makeLink();
    link.received(welcome(7n));
    link.send(batch(0, 1, "00000000000000aa"));
    link.send(batch(1, 2, "00000000000000bb"));
    link.received(feedback(0, 1, 0xaan));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 1 });
  });

  test("an answer to several batches at once without a hash says nothing of hashes", () => {
    const { link, said } = makeLink();
    link.received(welcome(7n));
    link.send(batch(0, 1, "00000000000000aa"));
    link.send(batch(1, 2, "00000000000000bb"));
    link.send(batch(2, 3, "00000000000000cc"));
    link.received(feedback(1, 2, null));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 0 });
    link.received(feedback(2, 3, 0xccn));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 3 });
    link.received(Uint8Array.from([133, 2, 4, 0, 0, 0, 0]));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 3 });
  });

  test("a count of cycles that differs needs no hash", () => {
    const { link, said } = makeLink();
    link.received(welcome(7n));
    link.send(batch(0, 1, "00000000000000aa"));
    link.received(feedback(0, 3, null));
    expect(said.at(-1)).toEqual({ kind: "differs", cycle: 1 });
  });

  test("a server that couples hand and bit otherwise is not compared, and keeps the drill all the same", () => {
    for (const other of [
      { stiffness_N_mm: 0, damping_N_s_mm: 0 },
      { stiffness_N_mm: 2, damping_N_s_mm: 0 },
      { stiffness_N_mm: 5, damping_N_s_mm: 0.001 },
    ]) {
      const { link, said, sent } = makeLink();
      link.opened();
      link.received(welcome(7n, other));
      link.send(batch(0, 1, "00000000000000aa"));
      link.received(feedback(0, 1, 0xabn));
      expect(said).toEqual([{ kind: "not_compared" }]);
      expect(sent.length).toBe(2);
    }
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
