// Keys and pads to what the hand asks for. Pure; the Drill room feeds it events.
import { kStill, type Steering } from "../worker/motion";

/** The keys, by KeyboardEvent.code so that other layouts keep their places; shown in the room. */
export const kKeys = {
  KeyW: "advance",
  KeyS: "withdraw",
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

export interface Hand {
  held: ReadonlySet<Action>;
  /** From the pads, -1 .. 1. */
  pad: { advance: number; sideways: [number, number] };
  spinning: boolean;
  feed_mm_s: number;
  fine: boolean;
  /** The screen's right and up as directions across the bit, so that "left" is what the eye calls left. */
  screen: { right: [number, number]; up: [number, number] };
}

export type HandEvent =
  | { type: "press" | "release"; action: Action }
  | { type: "release_all" }
  | { type: "pad_advance"; value: number }
  | { type: "pad_sideways"; value: [number, number] }
  | { type: "spin"; on: boolean }
  | { type: "feed"; mm_s: number }
  | { type: "fine"; on: boolean }
  | { type: "screen"; right: [number, number]; up: [number, number] };

export const kRestingHand: Hand = {
  held: new Set(),
  pad: { advance: 0, sideways: [0, 0] },
  spinning: true,
  feed_mm_s: 2,
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
      return { ...hand, held: new Set(), pad: { advance: 0, sideways: [0, 0] }, fine: false };
    case "pad_advance":
      return { ...hand, pad: { ...hand.pad, advance: event.value } };
    case "pad_sideways":
      return { ...hand, pad: { ...hand.pad, sideways: event.value } };
    case "spin":
      return { ...hand, spinning: event.on };
    case "feed":
      return { ...hand, feed_mm_s: event.mm_s };
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
  return {
    ...kStill,
    advance: gain * (key("advance", "withdraw") + hand.pad.advance),
    sideways: onScreen(key("right", "left") + hand.pad.sideways[0], key("up", "down") + hand.pad.sideways[1]),
    tilt: onScreen(key("lean right", "lean left"), key("lean up", "lean down")),
    spinning: hand.spinning,
    feed_mm_s: hand.feed_mm_s,
  };
}
