import type { NewPath, PathInfo } from "@web/contract/rest";
import { definitionOf, type Plan, type PlannedPath, withEnd, without } from "@web/state/plan";
import { kRest_ms, PlanSaver, type SaveState } from "@web/state/plan_saver";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

const planned = (key: string): PlannedPath => ({
  key,
  label: key,
  entry_patient: [0, 30, 0],
  target_patient: [0, 0, 0],
  bit: { diameter_mm: 3, cone_length_mm: 5, length_mm: 50 },
  volume_radius_mm: 4,
  lead_mm: 4,
  spacing_mm: 0.1,
});
const infoOf = (id: string, path: NewPath): PathInfo => ({ ...path, id }) as unknown as PathInfo;

/** The server of a test: it keeps paths as the real one does, and fails when told to. */
class FakeServer {
  readonly paths = new Map<string, NewPath>();
  readonly drilled = new Set<string>();
  readonly asked: string[] = [];
  /** Thrown at the next requests, one each. */
  readonly failures: Error[] = [];
  private next = 100;

  constructor(there: PlannedPath[]) {
    for (const path of there) this.paths.set(path.key, definitionOf(path));
  }
  readonly store = {
    add: async (path: NewPath) => {
      await this.answer("add");
      const id = `p${this.next++}`;
      this.paths.set(id, path);
      return infoOf(id, path);
    },
    replace: async (id: string, path: NewPath) => {
      await this.answer(`replace ${id}`);
      if (!this.paths.has(id)) throw refusal(404, "there is no such path");
      if (!this.drilled.has(id)) {
        this.paths.set(id, path);
        return infoOf(id, path);
      }
      this.paths.delete(id);
      const made = `p${this.next++}`;
      this.paths.set(made, path);
      return infoOf(made, path);
    },
    remove: async (id: string) => {
      await this.answer(`remove ${id}`);
      if (!this.paths.delete(id)) throw refusal(404, "there is no such path");
    },
  };
  private async answer(what: string): Promise<void> {
    this.asked.push(what);
    await new Promise((done) => setTimeout(done, 10));
    const failure = this.failures.shift();
    if (failure) throw failure;
  }
}

function refusal(status: number, message: string): Error {
  return Object.assign(new Error(message), { status });
}

function begin(keys: string[]) {
  const there = keys.map(planned);
  const server = new FakeServer(there);
  const states: SaveState[] = [];
  const saver = new PlanSaver(
    server.store,
    { onState: (state) => states.push(state), onKept: () => {}, onGone: () => {} },
    there.map((path) => infoOf(path.key, definitionOf(path))),
  );
  const last = (): SaveState => states[states.length - 1]!;
  return { there: there as Plan, server, saver, last };
}
const afterRest = (): Promise<unknown> => vi.advanceTimersByTimeAsync(kRest_ms + 500);

beforeEach(() => {
  vi.useFakeTimers();
});
afterEach(() => {
  vi.useRealTimers();
});

describe("autosave", () => {
  test("waits until the drag rests, then asks once, with what it came to", async () => {
    const { there, server, saver, last } = begin(["p1", "p2"]);
    let plan = there;
    for (let i = 1; i <= 20; ++i) {
      plan = withEnd(plan, "p1", "target", [i, 0, 0]);
      saver.update(plan);
      await vi.advanceTimersByTimeAsync(kRest_ms / 2);
    }
    expect(server.asked).toEqual([]);
    expect(last()).toEqual({ state: "waiting" });
    expect(saver.dirty).toBe(true);
    await afterRest();
    expect(server.asked).toEqual(["replace p1"]);
    expect(server.paths.get("p1")!.target_patient).toEqual([20, 0, 0]);
    expect(last()).toEqual({ state: "saved" });
    expect(saver.dirty).toBe(false);
  });

  test("what changes while it saves is saved after it, and at last the server has the plan", async () => {
    const { there, server, saver } = begin(["p1"]);
    saver.update(withEnd(there, "p1", "target", [1, 0, 0]));
    await vi.advanceTimersByTimeAsync(kRest_ms + 1);
    saver.update(withEnd(there, "p1", "target", [2, 0, 0]));
    await afterRest();
    expect(server.asked).toEqual(["replace p1", "replace p1"]);
    expect(server.paths.get("p1")!.target_patient).toEqual([2, 0, 0]);
  });

  test("undone before it was saved, nothing is asked", async () => {
    const { there, server, saver, last } = begin(["p1"]);
    saver.update(withEnd(there, "p1", "target", [1, 0, 0]));
    saver.update([...there]);
    await afterRest();
    expect(server.asked).toEqual([]);
    expect(last()).toEqual({ state: "saved" });
  });

  test("new paths get an id and are replaced under it from then on; deleted ones go", async () => {
    const { there, server, saver } = begin(["p1"]);
    const plan: Plan = [...there, planned("new-1")];
    saver.update(plan);
    await afterRest();
    const id = saver.idOf("new-1")!;
    expect(id).toBe("p100");
    saver.update(withEnd(plan, "new-1", "target", [5, 0, 0]));
    await afterRest();
    saver.update(without(plan, "new-1"));
    await afterRest();
    expect(server.asked).toEqual(["add", `replace ${id}`, `remove ${id}`]);
    expect([...server.paths.keys()]).toEqual(["p1"]);
  });

  test("a drilled path comes back under a new id, which later edits go to", async () => {
    const { there, server, saver } = begin(["p1"]);
    server.drilled.add("p1");
    saver.update(withEnd(there, "p1", "target", [1, 0, 0]));
    await afterRest();
    saver.update(withEnd(there, "p1", "target", [2, 0, 0]));
    await afterRest();
    expect(server.asked).toEqual(["replace p1", "replace p100"]);
    expect(saver.has("p1")).toBe(true);
  });

  test("without an answer it says why, and tries again by itself, more and more seldom", async () => {
    const { there, server, saver, last } = begin(["p1"]);
    for (let i = 0; i < 3; ++i) server.failures.push(refusal(0, "The server does not answer."));
    saver.update(withEnd(there, "p1", "target", [1, 0, 0]));
    await afterRest();
    expect(last()).toEqual({ state: "failed", reason: "The server does not answer.", retry_s: 2 });
    await vi.advanceTimersByTimeAsync(2100);
    expect(last()).toMatchObject({ state: "failed", retry_s: 4 });
    expect(saver.dirty).toBe(true);
    await vi.advanceTimersByTimeAsync(4100);
    expect(last()).toMatchObject({ state: "failed", retry_s: 8 });
    await vi.advanceTimersByTimeAsync(8100);
    expect(last()).toEqual({ state: "saved" });
    expect(server.asked.length).toBe(4);
  });

  test("what is refused is not asked again until it changes; the rest is saved", async () => {
    const { there, server, saver, last } = begin(["p1", "p2"]);
    server.failures.push(refusal(422, "path: there is no bone along it"));
    const bad = withEnd(withEnd(there, "p1", "target", [1, 0, 0]), "p2", "target", [2, 0, 0]);
    saver.update(bad);
    await afterRest();
    expect(server.asked).toEqual(["replace p1", "replace p2"]);
    expect(last()).toEqual({ state: "failed", reason: "path: there is no bone along it", retry_s: null });
    expect(saver.dirty).toBe(true);
    await vi.advanceTimersByTimeAsync(120_000);
    expect(server.asked.length).toBe(2);
    saver.update(withEnd(bad, "p1", "target", [3, 0, 0]));
    await afterRest();
    expect(last()).toEqual({ state: "saved" });
  });

  test("and on request it is asked again as it is", async () => {
    const { there, server, saver, last } = begin(["p1"]);
    server.failures.push(refusal(422, "no"));
    saver.update(withEnd(there, "p1", "target", [1, 0, 0]));
    await afterRest();
    saver.retry();
    await afterRest();
    expect(last()).toEqual({ state: "saved" });
  });

  test("a path that was deleted elsewhere becomes a new one rather than being lost", async () => {
    const { there, server, saver, last } = begin(["p1", "p2"]);
    server.paths.clear();
    saver.update(without(withEnd(there, "p1", "target", [1, 0, 0]), "p2"));
    await afterRest();
    expect(last()).toEqual({ state: "saved" });
    expect([...server.paths.values()].map(({ target_patient }) => target_patient)).toEqual([[1, 0, 0]]);
    expect(saver.idOf("p1")).not.toBe("p1");
  });

  test("from any edits and any failures, in the end the server has the plan", async () => {
    let seed = 20261123;
    const random = (): number => {
      seed = (seed * 1103515245 + 12345) % 2147483648;
      return seed / 2147483648;
    };
    const { there, server, saver, last } = begin(["p1", "p2", "p3"]);
    let plan = there;
    for (let i = 0; i < 300; ++i) {
      const at = Math.floor(random() * plan.length);
      const roll = random();
      if (roll < 0.15 || plan.length === 0) plan = [...plan, planned(`new-${i}`)];
      else if (roll < 0.25) plan = without(plan, plan[at]!.key);
      else plan = withEnd(plan, plan[at]!.key, "target", [Math.floor(random() * 50), 0, 0]);
      if (random() < 0.1) server.failures.push(refusal(random() < 0.5 ? 0 : 503, "later"));
      const ids = [...server.paths.keys()];
      if (random() < 0.1 && ids.length > 0) server.drilled.add(ids[0]!);
      saver.update(plan);
      await vi.advanceTimersByTimeAsync(random() * 2000);
    }
    await vi.advanceTimersByTimeAsync(300_000);
    expect(last(), "seed 20261123").toEqual({ state: "saved" });
    const there_now = [...server.paths.values()].map((path) => JSON.stringify(path)).sort();
    expect(there_now).toEqual(plan.map((path) => JSON.stringify(definitionOf(path))).sort());
  });
});
