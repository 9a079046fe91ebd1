// The line to the server over a wire of nothing, with a clock that the tests turn.
import { type ClientMessage, decodeClientMessage } from "@web/contract/drill_messages";
import type { Batch } from "@web/worker/drill_loop";
import { kMostUnanswered } from "@web/worker/outbox";
import { type Agreement, type LinkEvents, ServerLink, type WireEvents } from "@web/worker/server_link";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

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
const kToken = Uint8Array.from({ length: 16 }, (_, i) => 100 + i);
function welcome(
  hash: bigint,
  other: { next?: number; stiffness?: number; damping?: number } = {},
): Uint8Array {
  const bytes = new Uint8Array(63);
  bytes.set([129, 2]);
  bytes.set(kToken, 15);
  const view = new DataView(bytes.buffer);
  view.setBigUint64(3, hash, true);
  view.setUint32(31, other.next ?? 0, true);
  view.setFloat64(35, other.stiffness ?? 5, true);
  view.setFloat64(43, other.damping ?? 0, true);
  return bytes;
}
function withText(type: number, ...texts: string[]): Uint8Array {
  const bytes = [type, 2];
  for (const text of texts) bytes.push(text.length, 0, 0, 0, ...new TextEncoder().encode(text));
  return Uint8Array.from(bytes);
}
/** The state after cycle c is c, but for the start's, which is 7. */
const hashOf = (cycle: number): string => (cycle === 0 ? 7 : cycle).toString(16).padStart(16, "0");

function batch(first_seq: number, count: number, cycle: number): Batch {
  const poses = Array.from({ length: count }, (_, i) => ({
    t_us: 1000 * (cycle - count + 1 + i),
    tip: [0, 0, 0] as [number, number, number],
    axis: [0, 0, 1] as [number, number, number],
    spinning: true,
  }));
  return { first_seq, poses, cycle, hash: hashOf(cycle) };
}

/** One connection: what was said over it, and a way to answer. */
class Call {
  sent: ClientMessage[] = [];
  closed = false;
  constructor(readonly heard: WireEvents) {}
  send(bytes: Uint8Array): void {
    if (this.closed) throw new Error("sent over a closed wire");
    this.sent.push(decodeClientMessage(bytes));
  }
  close(): void {
    this.closed = true;
  }
  /** First pose and how many, of each batch. */
  batches(): [number, number][] {
    return this.sent.flatMap((message) =>
      message.type === "poses" ? [[message.first_seq, message.poses.length] as [number, number]] : [],
    );
  }
}

function makeLink() {
  const calls: Call[] = [];
  const said: Agreement[] = [];
  const finished: string[] = [];
  const events: LinkEvents = {
    agreement: (agreement) => void said.push(agreement),
    finished: (id) => void finished.push(id),
  };
  const dial = (heard: WireEvents): Call => {
    calls.push(new Call(heard));
    return calls.at(-1)!;
  };
  const link = new ServerLink(dial, hashOf(0), 5, events);
  link.connect();
  return { link, calls, said, finished, last: () => calls.at(-1)! };
}

/** A drill that goes on: welcome, two batches of 4 sent, the first of them answered. */
function makeBusyLink() {
  const made = makeLink();
  made.last().heard.opened();
  made.last().heard.received(welcome(7n));
  made.link.send(batch(0, 4, 4));
  made.link.send(batch(4, 4, 8));
  made.last().heard.received(feedback(3, 4, 4n));
  expect(made.said.at(-1)).toEqual({ kind: "agrees", cycle: 4 });
  return made;
}
/** The next try of a link whose line has just ended; the server's welcome is the caller's. */
function nextCall({ calls, last }: ReturnType<typeof makeLink>): Call {
  const before = calls.length;
  vi.advanceTimersByTime(8000);
  expect(calls.length).toBe(before + 1);
  last().heard.opened();
  return last();
}

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

describe("the line to the server", () => {
  test("says hello, waits for the welcome, then sends what it held", () => {
    const { link, last } = makeLink();
    last().heard.opened();
    link.send(batch(0, 1, 1));
    expect(last().sent.length).toBe(1);
    last().heard.received(welcome(7n));
    expect(last().sent.map(({ type }) => type)).toEqual(["hello", "poses"]);
    expect(last().sent[0]).toMatchObject({
      role: "drive",
      rigid: false,
      max_stiffness_N_mm: 5,
      damping_N_s_mm: 0,
      device_rate_hz: 0,
      token: null,
    });
  });

  test("agrees when the hashes of the same cycle are equal", () => {
    const { link, last, said } = makeLink();
    last().heard.received(welcome(7n));
    expect(said).toEqual([{ kind: "agrees", cycle: 0 }]);
    link.send(batch(0, 1, 1));
    link.send(batch(1, 1, 2));
    last().heard.received(feedback(0, 1, 1n));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 1 });
  });

  test("an answer to several batches at once without a hash says nothing of hashes", () => {
    const { link, last, said } = makeLink();
    last().heard.received(welcome(7n));
    for (const i of [0, 1, 2]) link.send(batch(i, 1, i + 1));
    last().heard.received(feedback(1, 2, null));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 0 });
    last().heard.received(feedback(2, 3, 3n));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 3 });
    last().heard.received(Uint8Array.from([133, 2, 4, 0, 0, 0, 0]));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 3 });
  });

  test("a count of cycles that differs needs no hash", () => {
    const { link, last, said } = makeLink();
    last().heard.received(welcome(7n));
    link.send(batch(0, 1, 1));
    last().heard.received(feedback(0, 3, null));
    expect(said.at(-1)).toEqual({ kind: "differs", cycle: 1 });
  });

  test("a server that couples hand and bit otherwise is not compared, and keeps the drill all the same", () => {
    for (const other of [{ stiffness: 0 }, { stiffness: 2 }, { damping: 0.001 }]) {
      const { link, last, said } = makeLink();
      last().heard.opened();
      last().heard.received(welcome(7n, other));
      link.send(batch(0, 1, 1));
      last().heard.received(feedback(0, 1, 9n));
      expect(said).toEqual([{ kind: "not_compared" }]);
      expect(last().batches()).toEqual([[0, 1]]);
    }
  });

  test("a differing hash, start state or cycle count is said once and stays said", () => {
    for (const wrong of [feedback(0, 1, 9n), feedback(0, 3, 1n)]) {
      const { link, last, said } = makeLink();
      last().heard.received(welcome(7n));
      link.send(batch(0, 1, 1));
      last().heard.received(wrong);
      link.send(batch(1, 1, 2));
      last().heard.received(feedback(1, 2, 2n));
      expect(said.at(-1)).toEqual({ kind: "differs", cycle: 1 });
    }
    const { last, said } = makeLink();
    last().heard.received(welcome(8n));
    expect(said).toEqual([{ kind: "differs", cycle: 0 }]);
  });

  test("a refusal, rubbish, or a line that never opened means offline, with the reason", () => {
    const rubbish = makeBusyLink();
    rubbish.last().heard.received(Uint8Array.from([99, 2]));
    expect(rubbish.said.at(-1)).toMatchObject({ kind: "offline" });
    const refused = makeLink();
    refused.last().heard.received(withText(132, "no such session"));
    expect(refused.said.at(-1)).toEqual({ kind: "offline", reason: "the server refused: no such session" });
    const closed = makeLink();
    closed.last().heard.ended("the line to the server closed");
    expect(closed.said.at(-1)).toEqual({ kind: "offline", reason: "the line to the server closed" });
    for (const { link, calls, last, said } of [rubbish, refused, closed]) {
      const told = said.length;
      expect(link.offline).toBe(true);
      link.send(batch(8, 1, 9));
      last().heard.received(welcome(7n));
      vi.advanceTimersByTime(120_000);
      expect([calls.length, said.length], "and nothing more is tried or said").toEqual([1, told]);
    }
  });

  test("finishing says so, after all that was drilled", () => {
    const { link, last, finished, said } = makeBusyLink();
    link.finish();
    expect(last().sent.at(-1)).toEqual({ type: "finish" });
    last().heard.received(feedback(7, 8, 8n));
    last().heard.received(withText(131, "r7k2m9xq", "{}"));
    last().heard.ended("closed");
    expect(finished).toEqual(["r7k2m9xq"]);
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 8 });
  });
});

describe("a line that breaks", () => {
  test("is made anew with the token, and what the server had not taken is sent again", () => {
    const made = makeBusyLink();
    const { link, calls, said } = made;
    calls[0]!.heard.ended("cut");
    expect(said.at(-1)).toEqual({ kind: "reconnecting" });
    link.send(batch(8, 4, 12)); // the drill goes on meanwhile
    const again = nextCall(made);
    expect(again.sent).toEqual([expect.objectContaining({ type: "hello", role: "drive", token: kToken })]);
    link.send(batch(12, 4, 16));
    again.heard.received(welcome(4n, { next: 4 }));
    expect(again.batches()).toEqual([
      [4, 4],
      [8, 4],
      [12, 4],
    ]);
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 4 });
    again.heard.received(feedback(15, 16, 16n));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 16 });
    expect(calls[0]!.closed).toBe(true);
  });

  test("what was taken but not answered is not sent twice, and its hash is compared all the same", () => {
    for (const [hash, verdict] of [
      [8n, { kind: "agrees", cycle: 8 }],
      [9n, { kind: "differs", cycle: 8 }],
    ] as const) {
      const made = makeBusyLink();
      made.last().heard.ended("cut");
      const again = nextCall(made);
      again.heard.received(welcome(hash, { next: 8 }));
      expect(again.batches()).toEqual([]);
      expect(made.said.at(-1)).toEqual(verdict);
    }
  });

  test("a batch that was taken in part is gone on with where it was, and its end compared", () => {
    const made = makeBusyLink();
    made.last().heard.ended("cut");
    const again = nextCall(made);
    again.heard.received(welcome(6n, { next: 6 }));
    expect(again.batches()).toEqual([[6, 2]]);
    expect(made.said.at(-1), "as of what was compared last").toEqual({ kind: "agrees", cycle: 4 });
    again.heard.received(feedback(7, 8, 8n));
    expect(made.said.at(-1)).toEqual({ kind: "agrees", cycle: 8 });
  });

  test("where the numbers wrap too", () => {
    const made = makeLink();
    const { link, last, said } = made;
    last().heard.received(welcome(7n));
    const top = 0xffff_fffa;
    link.send(batch(top, 4, 4));
    link.send(batch(top + 4, 4, 8));
    link.send(batch(2, 4, 12));
    last().heard.received(feedback(top + 3, 4, 4n));
    last().heard.ended("cut");
    const again = nextCall(made);
    again.heard.received(welcome(7n, { next: 1 }));
    expect(again.batches()).toEqual([
      [1, 1],
      [2, 4],
    ]);
    again.heard.received(feedback(1, 8, 8n));
    again.heard.received(feedback(5, 12, 12n));
    expect(said.at(-1)).toEqual({ kind: "agrees", cycle: 12 });
  });

  test("a refused resume means offline at once, with the server's reason", () => {
    const made = makeBusyLink();
    made.last().heard.ended("cut");
    nextCall(made).heard.received(withText(132, "the token is not this session's"));
    made.last().heard.ended("closed");
    expect(made.said.at(-1)).toEqual({
      kind: "offline",
      reason: "the server refused: the token is not this session's",
    });
    vi.advanceTimersByTime(120_000);
    expect(made.calls.length).toBe(2);
  });

  test("a server that is elsewhere in the drill is not gone on with", () => {
    for (const next of [2, 9]) {
      const made = makeBusyLink();
      made.last().heard.ended("cut");
      const again = nextCall(made);
      again.heard.received(welcome(2n, { next }));
      expect(made.said.at(-1)).toMatchObject({ kind: "offline" });
      expect(again.batches()).toEqual([]);
      expect(again.closed).toBe(true);
    }
  });

  test("tries with growing waits for a minute, no longer", () => {
    const made = makeBusyLink();
    const { calls, said, last } = made;
    const began = performance.now();
    const tried: number[] = [];
    for (last().heard.ended("cut"); said.at(-1)!.kind === "reconnecting"; last().heard.ended("cut")) {
      const before = calls.length;
      while (calls.length === before) vi.advanceTimersByTime(50);
      tried.push(performance.now() - began);
    }
    expect(tried.slice(0, 6)).toEqual([250, 750, 1750, 3750, 7750, 15_750]);
    expect(tried.at(-1)).toBeLessThanOrEqual(60_000);
    expect(tried.at(-1)).toBeGreaterThan(50_000);
    expect(tried.length).toBeLessThan(15);
    expect(said.at(-1)).toEqual({ kind: "offline", reason: "cut, and could not be made anew" });
  });

  test("that breaks again goes on again", () => {
    const made = makeBusyLink();
    for (let i = 0; i < 20; ++i) {
      made.last().heard.ended("cut");
      nextCall(made).heard.received(welcome(4n, { next: 4 }));
      made.last().heard.received(feedback(3, 4, null));
    }
    made.last().heard.ended("cut");
    vi.advanceTimersByTime(250);
    expect(made.calls.length, "a line that worked is tried at once again").toBe(22);
    made.last().heard.received(welcome(4n, { next: 4 }));
    expect(made.last().batches()).toEqual([[4, 4]]);
    expect(made.said.at(-1)).toEqual({ kind: "agrees", cycle: 4 });
  });

  test("that is silent where an answer is due is dead, and one that has nothing to say is not", () => {
    const made = makeBusyLink();
    vi.advanceTimersByTime(9000);
    made.last().heard.received(feedback(3, 4, null));
    vi.advanceTimersByTime(9000);
    expect(made.said.at(-1)!.kind).toBe("agrees");
    vi.advanceTimersByTime(1500);
    expect(made.calls[0]!.closed).toBe(true);
    expect(made.calls.length).toBe(2);
    made.last().heard.opened();
    made.last().heard.received(welcome(8n, { next: 8 }));
    vi.advanceTimersByTime(300_000);
    expect(made.calls.length, "all is answered: nobody need speak").toBe(2);
    expect(made.said.at(-1)).toEqual({ kind: "agrees", cycle: 8 });
  });

  test("what an earlier wire still tells is not heard", () => {
    const made = makeBusyLink();
    const first = made.last();
    first.heard.ended("cut");
    const again = nextCall(made);
    again.heard.received(welcome(4n, { next: 4 }));
    first.heard.received(feedback(7, 8, 9n));
    first.heard.ended("cut again");
    expect(made.said.at(-1)).toEqual({ kind: "agrees", cycle: 4 });
    expect(made.calls.length).toBe(2);
  });

  test("is given up when more waits than the page may keep", () => {
    const made = makeBusyLink();
    made.last().heard.ended("cut");
    const count = 4096;
    const fits = Math.floor((kMostUnanswered - 4) / count);
    for (let i = 0; i <= fits; ++i) {
      expect(made.link.offline).toBe(false);
      made.link.send(batch(8 + i * count, count, 8 + (i + 1) * count));
    }
    expect(made.said.at(-1)).toEqual({
      kind: "offline",
      reason: "the server has not answered for too long",
    });
    vi.advanceTimersByTime(120_000);
    expect(made.calls.length).toBe(1);
  });

  test("while it is finished, finishes when it is there again", () => {
    const made = makeBusyLink();
    made.last().heard.ended("cut");
    made.link.finish();
    const again = nextCall(made);
    again.heard.received(welcome(4n, { next: 4 }));
    expect(again.sent.map(({ type }) => type)).toEqual(["hello", "poses", "finish"]);
    again.heard.received(withText(131, "r7k2m9xq", "{}"));
    expect(made.finished).toEqual(["r7k2m9xq"]);
  });

  test("keeping a recording may take longer than drilling", () => {
    const made = makeBusyLink();
    made.link.finish();
    vi.advanceTimersByTime(50_000);
    expect(made.calls.length).toBe(1);
    made.last().heard.received(withText(131, "r7k2m9xq", "{}"));
    vi.advanceTimersByTime(120_000);
    expect(made.calls.length).toBe(1);
    expect(made.finished).toEqual(["r7k2m9xq"]);
  });

  test("need not be waited for", () => {
    const made = makeBusyLink();
    made.last().heard.ended("cut");
    made.link.finish();
    made.link.giveUp("it was not waited for");
    vi.advanceTimersByTime(120_000);
    expect(made.said.at(-1)).toEqual({ kind: "offline", reason: "it was not waited for" });
    expect(made.calls.length).toBe(1);
  });
});
