// Undo and redo: what was, what is, what was undone. Pure.

export interface History<T> {
  past: readonly T[];
  present: T;
  future: readonly T[];
  /** The gesture that the last edit belongs to: a drag is one edit, however many steps it takes. */
  gesture: string | null;
}

/** Older ones are forgotten. */
export const kMostUndone = 200;

export function historyOf<T>(present: T): History<T> {
  return { past: [], present, future: [], gesture: null };
}

/** `gesture`: edits in a row with the same one are undone together. An edit that changes nothing is none. */
export function edited<T>(history: History<T>, next: T, gesture: string | null = null): History<T> {
  if (next === history.present) return history;
  if (gesture !== null && gesture === history.gesture) return { ...history, present: next, future: [] };
  const past = [...history.past, history.present].slice(-kMostUndone);
  return { past, present: next, future: [], gesture };
}

/** What comes next is an edit of its own, whatever its gesture. */
export function sealed<T>(history: History<T>): History<T> {
  return history.gesture === null ? history : { ...history, gesture: null };
}

export function undone<T>({ past, present, future }: History<T>): History<T> {
  if (past.length === 0) return { past, present, future, gesture: null };
  return {
    past: past.slice(0, -1),
    present: past[past.length - 1]!,
    future: [present, ...future],
    gesture: null,
  };
}

export function redone<T>({ past, present, future }: History<T>): History<T> {
  if (future.length === 0) return { past, present, future, gesture: null };
  return { past: [...past, present], present: future[0]!, future: future.slice(1), gesture: null };
}
