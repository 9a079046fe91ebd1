// Autosave: brings the server's paths to what the page's plan is, one request at a time, after a short rest.
import type { NewPath, PathInfo } from "../contract/rest";
import { definitionOf, type Plan, plannedFrom } from "./plan";

export type SaveState =
  | { state: "saved" }
  | { state: "waiting" }
  | { state: "saving" }
  /** `retry_s`: null when only a change, or the person, can help. */
  | { state: "failed"; reason: string; retry_s: number | null };

/** The server, as the saver knows it. Rejections with a `status`: 0 when it did not answer, else HTTP's. */
export interface PathStore {
  add: (path: NewPath) => Promise<PathInfo>;
  replace: (id: string, path: NewPath) => Promise<PathInfo>;
  remove: (id: string) => Promise<void>;
}

export interface SaverEvents {
  onState: (state: SaveState) => void;
  /** The path of this page's `key` is at the server as `info`; its id may be a new one. */
  onKept: (key: string, info: PathInfo) => void;
  /** The server has no path of this key any more. */
  onGone: (key: string) => void;
}

/** Making the points takes seconds: a drag that rests for a moment is not worth them. */
export const kRest_ms = 900;
const kFirstRetry_s = 2;
const kLastRetry_s = 30;

interface Kept {
  id: string;
  text: string;
}

type Step =
  | { do: "remove"; key: string; id: string }
  | { do: "replace"; key: string; id: string; path: NewPath }
  | { do: "add"; key: string; path: NewPath };

export class PlanSaver {
  private readonly kept = new Map<string, Kept>();
  private plan: Plan;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private running = false;
  private retry_s = kFirstRetry_s;
  /** Definitions that the server refused: asked again only when they change, or by retry(). */
  private readonly refused = new Map<string, { text: string; reason: string }>();
  private closed = false;

  constructor(
    private readonly store: PathStore,
    private readonly events: SaverEvents,
    there: PathInfo[],
  ) {
    this.plan = there.map(plannedFrom);
    for (const path of this.plan) this.kept.set(path.key, { id: path.key, text: textOf(path) });
  }

  /** Call it with every change; saving begins when there was none for kRest_ms. */
  update(plan: Plan): void {
    if (plan === this.plan) return;
    this.plan = plan;
    this.retry_s = kFirstRetry_s;
    if (!this.running) this.schedule(kRest_ms);
  }

  /** At once, also what was refused. */
  retry(): void {
    this.refused.clear();
    if (!this.running) void this.run();
  }

  /** Of a key; null while the server does not know it. */
  idOf(key: string): string | null {
    return this.kept.get(key)?.id ?? null;
  }
  /** Whether the server has this path as it is now. */
  has(key: string): boolean {
    const path = this.plan.find((one) => one.key === key);
    return path !== undefined && this.kept.get(key)?.text === textOf(path);
  }
  /** Whether anything would be lost with the page. */
  get dirty(): boolean {
    return this.running || this.steps(true).length > 0;
  }

  /** No more requests and no more events; what was asked of the server is done there. */
  close(): void {
    this.closed = true;
    if (this.timer) clearTimeout(this.timer);
  }

  private schedule(after_ms: number): void {
    if (this.timer) clearTimeout(this.timer);
    if (this.closed) return;
    this.timer = null;
    if (this.steps(false).length === 0) {
      this.report();
      return;
    }
    this.tell({ state: "waiting" });
    this.timer = setTimeout(() => void this.run(), after_ms);
  }

  private async run(): Promise<void> {
    if (this.timer) clearTimeout(this.timer);
    this.timer = null;
    this.running = true;
    for (;;) {
      const step = this.steps(false)[0];
      if (!step || this.closed) break;
      this.tell({ state: "saving" });
      try {
        await this.take(step);
        this.retry_s = kFirstRetry_s;
      } catch (error) {
        if (!this.refuse(step, error)) return;
      }
    }
    this.running = false;
    this.report();
  }

  private async take(step: Step): Promise<void> {
    if (step.do === "remove") {
      await this.store.remove(step.id).catch((error) => {
        if (statusOf(error) !== 404) throw error; // gone already: that was the wish
      });
      this.forget(step.key);
      return;
    }
    const info =
      step.do === "add" ? await this.store.add(step.path) : await this.store.replace(step.id, step.path);
    this.kept.set(step.key, { id: info.id, text: JSON.stringify(step.path) });
    if (!this.closed) this.events.onKept(step.key, info);
  }

  private forget(key: string): void {
    this.kept.delete(key);
    if (!this.closed) this.events.onGone(key);
  }

  /** @returns whether there is more to do at once; else a retry is due, or nothing is. */
  private refuse(step: Step, error: unknown): boolean {
    const reason = error instanceof Error ? error.message : String(error);
    const status = statusOf(error);
    if (step.do === "replace" && status === 404) {
      this.forget(step.key); // deleted or replaced elsewhere: what is here becomes a path of its own
      return true;
    }
    if (status >= 400 && status < 500) {
      this.refused.set(step.key, { text: wishOf(step), reason });
      return true;
    }
    this.running = false;
    if (this.closed) return false;
    this.tell({ state: "failed", reason, retry_s: this.retry_s });
    this.timer = setTimeout(() => void this.run(), 1000 * this.retry_s);
    this.retry_s = Math.min(kLastRetry_s, 2 * this.retry_s);
    return false;
  }

  private report(): void {
    if (this.closed) return;
    const wanted = this.steps(true);
    if (wanted.length === 0) {
      this.tell({ state: "saved" });
      return;
    }
    const reason = this.refused.get(wanted[0]!.key)?.reason ?? "";
    this.tell({ state: "failed", reason, retry_s: null });
  }

  private tell(state: SaveState): void {
    if (!this.closed) this.events.onState(state);
  }

  /** What the server lacks, deletions first. */
  private steps(with_refused: boolean): Step[] {
    const steps: Step[] = [];
    for (const [key, { id }] of this.kept) {
      if (!this.plan.some((path) => path.key === key)) steps.push({ do: "remove", key, id });
    }
    for (const planned of this.plan) {
      const kept = this.kept.get(planned.key);
      const path = definitionOf(planned);
      if (!kept) steps.push({ do: "add", key: planned.key, path });
      else if (kept.text !== JSON.stringify(path))
        steps.push({ do: "replace", key: planned.key, id: kept.id, path });
    }
    if (with_refused) return steps;
    return steps.filter((step) => this.refused.get(step.key)?.text !== wishOf(step));
  }
}

function textOf(path: Plan[number]): string {
  return JSON.stringify(definitionOf(path));
}
function wishOf(step: Step): string {
  return step.do === "remove" ? "remove" : JSON.stringify(step.path);
}
function statusOf(error: unknown): number {
  const status = (error as { status?: unknown } | null)?.status;
  return typeof status === "number" ? status : 0;
}
