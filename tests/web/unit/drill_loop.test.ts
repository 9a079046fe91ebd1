import { decodeClientMessage } from "@web/contract/drill_messages";
import { type Agreement, ServerLink } from "@web/worker/server_link";
import { standingOf } from "@web/worker/standing";
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

describe("what the page says of the server", () => {
  const answers: Agreement[] = [
    { kind: "agrees", cycle: 7, behind: 1 },
    { kind: "differs", cycle: 7 },
  ];
  const others: Agreement[] = [{ kind: "connecting" }, { kind: "offline", reason: "no line" }];

  test("sessions coupled alike are compared, others are not", () => {
    for (const answer of answers) {
      expect(standingOf(answer, true)).toEqual(answer);
      expect(standingOf(answer, false)).toEqual({ kind: "not_compared" });
    }
  });

  test("a line that is not there is said either way", () => {
    for (const other of others) expect(standingOf(other, false)).toEqual(other);
  });
});
