// Sound, off until it is asked for: the M key or the button.
import { useSignal, useSignalEffect } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import type { DrillSession } from "../state/drill_session";
import { kSpeed_rpm } from "../worker/motion";
import { isTyping } from "./drill_input";
import { DrillSound } from "./drill_sound";

export function SoundSwitch({ session }: { session: DrillSession }) {
  const on = useSignal(false);
  const hidden = useSignal(document.hidden);
  const sound = useRef<DrillSound | null>(null);
  const toggle = (): void => {
    sound.current ??= new DrillSound();
    on.value = !on.value;
  };
  useEffect(() => {
    const key = (event: KeyboardEvent): void => {
      if (event.code !== "KeyM" || event.repeat || isTyping(event.target)) return;
      if (!event.ctrlKey && !event.metaKey && !event.altKey) toggle();
    };
    const look = (): void => {
      hidden.value = document.hidden;
    };
    addEventListener("keydown", key);
    document.addEventListener("visibilitychange", look);
    return () => {
      removeEventListener("keydown", key);
      document.removeEventListener("visibilitychange", look);
      sound.current?.close();
    };
  }, []);
  useSignalEffect(() => {
    const readings = session.readings.value;
    const audible = on.value && !hidden.value && session.phase.value === "drilling";
    if (!audible || !readings) {
      sound.current?.hush();
      return;
    }
    sound.current?.play({
      speed_rpm: readings.spinning ? kSpeed_rpm : 0,
      torque_Nmm: readings.torque_Nmm,
      density_mg_cm3: readings.density_mg_cm3,
    });
  });
  return (
    <button type="button" class="sound" aria-pressed={on.value} aria-keyshortcuts="M" onClick={toggle}>
      {on.value ? "Sound is on" : "Sound is off"}
    </button>
  );
}
