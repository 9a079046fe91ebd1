// Keys, pads and a gamepad to what the arm is asked for: a push in newtons, never a position. Pure; the Drill room feeds
// it events.
import { kMostPull_N, kMostPush_N, kStill, type Steering } from "../worker/motion";

/** The keys, by KeyboardEvent.code so that other layouts keep their places; shown in the room. */
export const kKeys = {
  KeyW: "push",
  KeyS: "pull",
  ArrowUp: "up",
  ArrowDown: "down",
  ArrowLeft: "left",
  ArrowRight: "right",
  KeyQ: "lean left",
  KeyE: "lean right",
  KeyR: "lean up",
  KeyF: "lean down",
} as const;
export type Action = (typeof kKeys)[keyof typeof kKeys];

/** From pads and triggers: how far each is moved, -1 .. 1; push above 0 is deeper. */
export interface Lever {
  push: number;
  sideways: [number, number];
  tilt: [number, number];
}

export interface Hand {
  held: ReadonlySet<Action>;
  pad: Lever;
  gamepad: Lever;
  spinning: boolean;
  /** What a key that is held pushes with; a pad or a trigger goes up to kMostPush_N. */
  strength_N: number;
  fine: boolean;
  /** The screen's right and up as directions across the bit, so that "left" is what the eye calls left. */
  screen: { right: [number, number]; up: [number, number] };
}

export type HandEvent =
  | { type: "press" | "release"; action: Action }
  | { type: "release_all" }
  | { type: "pad_push"; value: number }
  | { type: "pad_sideways"; value: [number, number] }
  | { type: "spin"; on: boolean }
  | { type: "gamepad"; lever: Lever }
  | { type: "strength"; push_N: number }
  | { type: "fine"; on: boolean }
  | { type: "screen"; right: [number, number]; up: [number, number] };

export const kRestingLever: Lever = { push: 0, sideways: [0, 0], tilt: [0, 0] };

export const kRestingHand: Hand = {
  held: new Set(),
  pad: kRestingLever,
  gamepad: kRestingLever,
  spinning: true,
  strength_N: 30,
  fine: false,
  screen: { right: [1, 0], up: [0, 1] },
};

export function handAfter(hand: Hand, event: HandEvent): Hand {
  switch (event.type) {
    case "press":
      return { ...hand, held: new Set([...hand.held, event.action]) };
    case "release":
      return { ...hand, held: new Set([...hand.held].filter((action) => action !== event.action)) };
    case "release_all":
      return { ...hand, held: new Set(), pad: kRestingLever, gamepad: kRestingLever, fine: false };
    case "pad_push":
      return { ...hand, pad: { ...hand.pad, push: event.value } };
    case "pad_sideways":
      return { ...hand, pad: { ...hand.pad, sideways: event.value } };
    case "spin":
      return { ...hand, spinning: event.on };
    case "gamepad":
      return { ...hand, gamepad: event.lever };
    case "strength":
      return { ...hand, strength_N: event.push_N };
    case "fine":
      return { ...hand, fine: event.on };
    case "screen":
      return { ...hand, screen: { right: event.right, up: event.up } };
  }
}

export function steeringOf(hand: Hand): Steering {
  const gain = hand.fine ? 0.25 : 1;
  const key = (plus: Action, minus: Action): number =>
    Number(hand.held.has(plus)) - Number(hand.held.has(minus));
  const onScreen = (right: number, up: number): [number, number] => [
    gain * (right * hand.screen.right[0] + up * hand.screen.up[0]),
    gain * (right * hand.screen.right[1] + up * hand.screen.up[1]),
  ];
  const { pad, gamepad } = hand;
  const push_N =
    newtonsOf(key("push", "pull"), hand.strength_N) +
    newtonsOf(pad.push, kMostPush_N) +
    newtonsOf(gamepad.push, kMostPush_N);
  return {
    ...kStill,
    push_N: Math.max(-kMostPull_N, Math.min(kMostPush_N, gain * push_N)),
    sideways: onScreen(
      key("right", "left") + pad.sideways[0] + gamepad.sideways[0],
      key("up", "down") + pad.sideways[1] + gamepad.sideways[1],
    ),
    tilt: onScreen(
      key("lean right", "lean left") + gamepad.tilt[0],
      key("lean up", "lean down") + gamepad.tilt[1],
    ),
    spinning: hand.spinning,
  };
}

/** A lever of -1 .. 1; drawn back it only pulls as fingers do. */
function newtonsOf(lever: number, most_N: number): number {
  return lever * (lever > 0 ? most_N : kMostPull_N);
}
