// Pads for touch (and for the mouse): one that pushes the bit sideways, one that advances and withdraws it.
import { useSignal } from "@preact/signals";

type Push = [number, number];

interface PadProps {
  shape: "round" | "tall";
  label: string;
  /** What pushing up and pushing down do. */
  ends: [string, string];
  /** Called with -1 .. 1 to the right and upward; with zeros when let go. */
  onPush: (push: Push) => void;
}

export function Pad({ shape, label, ends, onPush }: PadProps) {
  const push = useSignal<Push>([0, 0]);
  const set = (next: Push): void => {
    push.value = next;
    onPush(next);
  };
  const read = (event: PointerEvent): void => {
    const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    const limit = (v: number): number => Math.max(-1, Math.min(1, v * 1.25));
    set([shape === "tall" ? 0 : eased(limit(x)), eased(limit(y))]);
  };
  return (
    <div
      class={`pad pad-${shape}`}
      aria-hidden="true"
      title={label}
      data-pad={shape}
      onPointerDown={(event) => {
        event.currentTarget.setPointerCapture(event.pointerId);
        read(event);
      }}
      onPointerMove={(event) => {
        if (event.currentTarget.hasPointerCapture(event.pointerId)) read(event);
      }}
      onPointerUp={() => set([0, 0])}
      onPointerCancel={() => set([0, 0])}
    >
      <span class="pad-end pad-top">{ends[0]}</span>
      <span class="pad-end pad-bottom">{ends[1]}</span>
      <span
        class="pad-knob"
        style={{ left: `${50 + 38 * push.value[0]}%`, top: `${50 - 38 * push.value[1]}%` }}
      />
    </div>
  );
}

/** A still middle, and fine control near it. */
function eased(v: number): number {
  const size = Math.max(0, Math.abs(v) - 0.08) / 0.92;
  return Math.sign(v) * size * size;
}
