// The buttons over a 3-D view that more than one room has.
import type { Signal } from "@preact/signals";
import type { RefObject } from "preact";
import type { VertebraScene } from "../scene/vertebra_scene";

export function Toggle({ text, on }: { text: string; on: Signal<boolean> }) {
  return (
    <button
      type="button"
      aria-pressed={on.value}
      onClick={() => {
        on.value = !on.value;
      }}
    >
      {text}
    </button>
  );
}

/** Towards the entry, and down the bit, which then becomes see-through. */
export function BitLooks({
  scene,
  ghost,
}: {
  scene: RefObject<VertebraScene | null>;
  ghost: Signal<boolean>;
}) {
  return (
    <>
      <button type="button" onClick={() => scene.current?.lookAtEntry()}>
        Entry
      </button>
      <button
        type="button"
        onClick={() => {
          ghost.value = true;
          scene.current?.lookAlongBit();
        }}
      >
        Along the bit
      </button>
    </>
  );
}
