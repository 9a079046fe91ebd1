// A case's plan while it is edited: its paths, undo and redo, which one is chosen, and whether the server has it.
import { computed, signal } from "@preact/signals";
import type { Vec3 } from "../contract/bodies";
import type { BitInfo, CaseDetail, PathInfo } from "../contract/rest";
import { addPath, removePath, replacePath } from "./api";
import { edited, type History, historyOf, redone, sealed, undone } from "./history";
import {
  definitionOf,
  drawnFrom,
  type End,
  mirrored,
  newPath,
  type Plan,
  plannedFrom,
  withBit,
  withEnd,
  withLabel,
  without,
} from "./plan";
import { type PathStore, PlanSaver, type SaveState } from "./plan_saver";

export class PlanSession {
  readonly history = signal<History<Plan>>(historyOf([]));
  readonly save = signal<SaveState>({ state: "saved" });
  /** What the server last said of each key. */
  readonly kept = signal<ReadonlyMap<string, PathInfo>>(new Map());
  readonly plan = computed(() => this.history.value.present);
  readonly drawn = computed(() => this.plan.value.map(drawnFrom));
  readonly chosen = computed(
    () => this.plan.value.find((path) => path.key === this.key.value) ?? this.plan.value[0] ?? null,
  );
  readonly chosen_drawn = computed(
    () => this.drawn.value.find((path) => path.id === this.chosen.value?.key) ?? null,
  );
  /** The chosen path at the server, while it is there as it is here. */
  readonly chosen_kept = computed(() => {
    const path = this.chosen.value;
    const info = path && this.kept.value.get(path.key);
    return path && info && textOf(info) === textOf(path) ? info : null;
  });
  private readonly key = signal<string | null>(null);
  private readonly saver: PlanSaver;
  private made = 0;

  constructor(detail: CaseDetail, store: PathStore) {
    this.history.value = historyOf(detail.paths.map(plannedFrom));
    this.kept.value = new Map(detail.paths.map((path) => [path.id, path]));
    this.saver = new PlanSaver(
      store,
      {
        onState: (state) => {
          this.save.value = state;
        },
        onKept: (key, info) => {
          this.kept.value = new Map(this.kept.value).set(key, info);
        },
        onGone: (key) => {
          this.kept.value = new Map([...this.kept.value].filter(([one]) => one !== key));
        },
      },
      detail.paths,
    );
  }

  get dirty(): boolean {
    return this.saver.dirty;
  }
  retry(): void {
    this.saver.retry();
  }
  close(): void {
    this.saver.close();
  }

  /** Whether nothing happened to the paths of the case but what was done here. */
  agreesWith(paths: PathInfo[]): boolean {
    const plan = this.plan.value;
    return (
      plan.length === paths.length &&
      plan.every((path) => {
        const info = this.kept.value.get(path.key);
        const there = paths.find((one) => one.id === info?.id);
        return there !== undefined && textOf(there) === textOf(path);
      })
    );
  }

  /** @param id  a key, or the server's id of a path. */
  choose(id: string): void {
    const by_id = [...this.kept.value].find(([, info]) => info.id === id)?.[0];
    this.key.value = by_id ?? id;
  }

  moveEnd(end: End, to: Vec3, gesture: string): void {
    this.change((plan, key) => withEnd(plan, key, end, to.map(toMicrometre) as Vec3), `${gesture} ${end}`);
  }
  setBit(bit: BitInfo): void {
    this.change((plan, key) => withBit(plan, key, bit), "bit");
  }
  rename(label: string): void {
    this.change((plan, key) => withLabel(plan, key, label));
  }
  add(entry: Vec3): void {
    this.insert((plan, key) => newPath(plan, key, entry.map(toMicrometre) as Vec3, this.chosen.peek()));
  }
  mirror(middle_x: number): void {
    const path = this.chosen.peek();
    if (path) this.insert((plan, key) => mirrored(plan, key, path, middle_x));
  }
  remove(): void {
    this.change(without);
  }
  /** The gesture is over: what comes next is undone by itself. */
  settle(): void {
    this.history.value = sealed(this.history.peek());
  }
  undo(): void {
    this.become(undone(this.history.peek()));
  }
  redo(): void {
    this.become(redone(this.history.peek()));
  }

  private insert(make: (plan: Plan, key: string) => Plan[number]): void {
    const key = `new-${++this.made}`;
    const plan = this.plan.peek();
    this.become(edited<Plan>(this.history.peek(), [...plan, make(plan, key)]));
    this.key.value = key;
  }
  private change(edit: (plan: Plan, key: string) => Plan, gesture: string | null = null): void {
    const path = this.chosen.peek();
    if (!path) return;
    const named = gesture === null ? null : `${gesture} ${path.key}`;
    this.become(edited(this.history.peek(), edit(this.plan.peek(), path.key), named));
  }
  private become(next: History<Plan>): void {
    this.history.value = next;
    this.saver.update(next.present);
  }
}

/** A server that gives back 16 digits gives back these; a thousandth of a millimetre is far below any voxel. */
function toMicrometre(v: number): number {
  return Math.round(v * 1000) / 1000;
}
function textOf(path: Parameters<typeof definitionOf>[0]): string {
  return JSON.stringify(definitionOf(path));
}

/** Of the case that was open last, and of every case whose edits are not saved. */
const sessions = new Map<string, PlanSession>();

/** The one of this case, with its undo and whatever is not saved yet; a new one when the server has something newer. */
export function planSessionOf(detail: CaseDetail): PlanSession {
  const here = sessions.get(detail.id);
  if (here && (here.dirty || here.agreesWith(detail.paths))) return here;
  here?.close();
  for (const [id, session] of sessions) if (!session.dirty) sessions.delete(id);
  const store: PathStore = {
    add: (path) => addPath(detail.id, path),
    replace: (id, path) => replacePath(detail.id, id, path),
    remove: (id) => removePath(detail.id, id),
  };
  const session = new PlanSession(detail, store);
  sessions.set(detail.id, session);
  return session;
}

/** Nothing that is not at the server is closed without asking. */
export function guardUnsaved(): void {
  addEventListener("beforeunload", (event) => {
    if ([...sessions.values()].some((session) => session.dirty)) event.preventDefault();
  });
}
