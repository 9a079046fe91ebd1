// Places in a fixed buffer for things that come and go by index, and which stretches of it changed. Pure.

/** A gap this short is cheaper to upload than a second call: drivers may copy a buffer in use at every call. */
const kJoin = 2048;

export class Slots {
  private readonly slot_of = new Map<number, number>();
  private readonly index_at: Uint32Array;
  private used = 0;
  private dirty: number[] = [];

  constructor(readonly capacity: number) {
    this.index_at = new Uint32Array(capacity);
  }

  get size(): number {
    return this.used;
  }

  /** The slot of `index`, taken now if it has none; -1 when the buffer is full. */
  take(index: number): number {
    let slot = this.slot_of.get(index);
    if (slot === undefined) {
      if (this.used === this.capacity) return -1;
      slot = this.used++;
      this.slot_of.set(index, slot);
      this.index_at[slot] = index;
    }
    this.dirty.push(slot);
    return slot;
  }

  /** Frees the slot of `index`; the last one moves into it, so that slots 0 .. size-1 are always in use. */
  free(index: number): { from: number; to: number } | null {
    const to = this.slot_of.get(index);
    if (to === undefined) return null;
    this.slot_of.delete(index);
    const from = --this.used;
    if (from === to) return null;
    const moved = this.index_at[from]!;
    this.index_at[to] = moved;
    this.slot_of.set(moved, to);
    this.dirty.push(to);
    return { from, to };
  }

  clear(): void {
    this.slot_of.clear();
    this.used = 0;
    this.dirty = [];
  }

  /** Stretches [start, end) of slots in use that changed since the last call, in order, near ones joined. */
  takeDirty(): [number, number][] {
    const slots = this.dirty.filter((slot) => slot < this.used).sort((a, b) => a - b);
    this.dirty = [];
    const ranges: [number, number][] = [];
    for (const slot of slots) {
      const last = ranges[ranges.length - 1];
      if (last && slot <= last[1] + kJoin) last[1] = Math.max(last[1], slot + 1);
      else ranges.push([slot, slot + 1]);
    }
    return ranges;
  }
}
