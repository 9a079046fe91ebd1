// A gamepad, asked every frame while one is there: its trigger pushes, and its motors give the force back.
import type { Signal } from "@preact/signals";
import { kSpinButton, leverOf, rumbleOf } from "../state/gamepad";
import type { Hand, HandEvent } from "../state/steering";
import type { Readings } from "../worker/drill_loop";

interface GamepadLine {
  hand: Signal<Hand>;
  tell: (event: HandEvent) => void;
  readings: Signal<Readings | null>;
}

/** An effect outlasts the time to the next by a little, so that it neither stutters nor stays. */
const kRumbleEvery_ms = 80;
const kRumbleLasts_ms = 120;

/** @returns what undoes it. */
export function attachGamepad({ hand, tell, readings }: GamepadLine): () => void {
  let frame = 0;
  let spin_down = false;
  let rumble_due = 0;
  let told = "";
  const ask = (now: number): void => {
    const pad = navigator.getGamepads().find((one) => one?.mapping === "standard");
    frame = pad ? requestAnimationFrame(ask) : 0;
    if (!pad) return;
    const lever = leverOf(pad);
    const key = JSON.stringify(lever);
    if (key !== told) tell({ type: "gamepad", lever });
    told = key;
    const down = pad.buttons[kSpinButton]?.pressed ?? false;
    if (down && !spin_down) tell({ type: "spin", on: !hand.peek().spinning });
    spin_down = down;
    if (now < rumble_due) return;
    rumble_due = now + kRumbleEvery_ms;
    shake(pad, readings.peek());
  };
  const come = (): void => {
    if (frame === 0) frame = requestAnimationFrame(ask);
  };
  const go = (): void => tell({ type: "release_all" });
  addEventListener("gamepadconnected", come);
  addEventListener("gamepaddisconnected", go);
  come();
  return () => {
    cancelAnimationFrame(frame);
    removeEventListener("gamepadconnected", come);
    removeEventListener("gamepaddisconnected", go);
  };
}

function shake(pad: Gamepad, now: Readings | null): void {
  // Not every browser has it, whatever its type says.
  const motors = pad.vibrationActuator as GamepadHapticActuator | null | undefined;
  // A bit that rests sends no readings any more: what it felt last is not felt for ever.
  if (!motors || !now || now.rate_hz === 0) return;
  const { strong, weak } = rumbleOf(now.thrust_N, now.torque_Nmm, now.spinning);
  const effect = { duration: kRumbleLasts_ms, strongMagnitude: strong, weakMagnitude: weak };
  motors.playEffect("dual-rumble", effect).catch(() => {});
}
