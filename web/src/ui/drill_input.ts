// Keys, and the pointer on the bit itself, for the Drill room. Elsewhere in the picture the pointer turns the camera.
import type { Signal } from "@preact/signals";
import type { VertebraScene } from "../scene/vertebra_scene";
import { type Action, type Hand, type HandEvent, kKeys } from "../state/steering";

interface HandLine {
  hand: Signal<Hand>;
  tell: (event: HandEvent) => void;
  /** Moves the aim across the bit, mm. */
  nudge: (across: [number, number]) => void;
  wheel: (push_N: number) => void;
}

/** One wheel notch. */
const kNotch_N = 3;

/** @returns what undoes it. */
export function attachHand(scene: VertebraScene, line: HandLine): () => void {
  const leave = [attachKeys(line), attachPointer(scene, line), followScreen(scene, line)];
  return () => {
    for (const undo of leave) undo();
  };
}

function attachKeys({ hand, tell }: HandLine): () => void {
  const down = (event: KeyboardEvent): void => {
    if (isTyping(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Shift") tell({ type: "fine", on: true });
    if (event.code === "Space" && !isPressable(event.target)) {
      event.preventDefault();
      if (!event.repeat) tell({ type: "spin", on: !hand.peek().spinning });
      return;
    }
    const action = actionOf(event.code);
    if (!action) return;
    event.preventDefault();
    if (!event.repeat) tell({ type: "press", action });
  };
  const up = (event: KeyboardEvent): void => {
    if (event.key === "Shift") tell({ type: "fine", on: false });
    const action = actionOf(event.code);
    if (action) tell({ type: "release", action });
  };
  const drop = (): void => tell({ type: "release_all" });
  addEventListener("keydown", down);
  addEventListener("keyup", up);
  addEventListener("blur", drop);
  document.addEventListener("visibilitychange", drop);
  return () => {
    removeEventListener("keydown", down);
    removeEventListener("keyup", up);
    removeEventListener("blur", drop);
    document.removeEventListener("visibilitychange", drop);
  };
}

function actionOf(code: string): Action | null {
  return (kKeys as Record<string, Action>)[code] ?? null;
}
export function isTyping(target: EventTarget | null): boolean {
  return target instanceof Element && target.matches("input, select, textarea");
}
/** Space on a button presses the button. */
function isPressable(target: EventTarget | null): boolean {
  return target instanceof Element && target.matches("button, a, summary");
}

function attachPointer(scene: VertebraScene, { nudge, wheel: turn }: HandLine): () => void {
  const canvas = scene.stage.controls.domElement as HTMLCanvasElement;
  let grabbed: { id: number; x: number; y: number } | null = null;
  const down = (event: PointerEvent): void => {
    if (event.button !== 0 || !scene.isOnBit(event)) return;
    // Before the camera's own listener, which would turn the picture instead.
    event.stopImmediatePropagation();
    canvas.setPointerCapture(event.pointerId);
    grabbed = { id: event.pointerId, x: event.clientX, y: event.clientY };
    canvas.style.cursor = "grabbing";
  };
  const move = (event: PointerEvent): void => {
    if (grabbed?.id !== event.pointerId) {
      if (event.buttons === 0) canvas.style.cursor = scene.isOnBit(event) ? "grab" : "";
      return;
    }
    event.stopImmediatePropagation();
    const [x, y] = scene.dragOnBit(event.clientX - grabbed.x, event.clientY - grabbed.y);
    nudge([x, y]);
    grabbed = { id: grabbed.id, x: event.clientX, y: event.clientY };
  };
  const up = (event: PointerEvent): void => {
    if (grabbed?.id !== event.pointerId) return;
    grabbed = null;
    canvas.style.cursor = "";
  };
  const wheel = (event: WheelEvent): void => {
    if (!scene.isOnBit(event)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    turn(Math.sign(event.deltaY) * kNotch_N);
  };
  const capture = { capture: true };
  canvas.addEventListener("pointerdown", down, capture);
  canvas.addEventListener("pointermove", move, capture);
  canvas.addEventListener("pointerup", up, capture);
  canvas.addEventListener("pointercancel", up, capture);
  canvas.addEventListener("wheel", wheel, { capture: true, passive: false });
  return () => {
    canvas.removeEventListener("pointerdown", down, capture);
    canvas.removeEventListener("pointermove", move, capture);
    canvas.removeEventListener("pointerup", up, capture);
    canvas.removeEventListener("pointercancel", up, capture);
    canvas.removeEventListener("wheel", wheel, capture);
  };
}

/** Keeps "left" and "up" what the eye calls left and up, as the camera turns. */
function followScreen(scene: VertebraScene, { tell }: HandLine): () => void {
  const update = (): void => {
    const { right, up } = scene.screenOnPath();
    tell({ type: "screen", right, up });
  };
  update();
  scene.stage.controls.addEventListener("change", update);
  return () => scene.stage.controls.removeEventListener("change", update);
}
