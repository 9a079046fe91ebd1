// Which room is open: the address's hash, so that every room can be reloaded, linked and left with Back.
import { signal } from "@preact/signals";

export type Route =
  | { room: "cases" }
  | { room: "case"; case_id: string; path_id: string | null }
  | { room: "drill"; case_id: string; path_id: string }
  | { room: "replay"; case_id: string; recording_id: string }
  | { room: "unknown"; address: string };

/** A drill that was done without the server lives in this page only, under this name. */
export const kLocalRecording = "this-page";

export function parseRoute(hash: string): Route {
  const parts = hash
    .replace(/^#?\/?/, "")
    .split("/")
    .filter(Boolean)
    .map(decodeURIComponent);
  const [head, case_id, room, id] = parts;
  if (head === undefined) return { room: "cases" };
  if (head === "case" && case_id !== undefined) {
    if (room === undefined) return { room: "case", case_id, path_id: null };
    if (room === "path" && id !== undefined) return { room: "case", case_id, path_id: id };
    if (room === "drill" && id !== undefined) return { room: "drill", case_id, path_id: id };
    if (room === "replay" && id !== undefined) return { room: "replay", case_id, recording_id: id };
  }
  return { room: "unknown", address: hash };
}

export function addressOf(route: Route): string {
  switch (route.room) {
    case "cases":
      return "#/";
    case "case":
      return `#/case/${encodeURIComponent(route.case_id)}${
        route.path_id === null ? "" : `/path/${encodeURIComponent(route.path_id)}`
      }`;
    case "drill":
      return `#/case/${encodeURIComponent(route.case_id)}/drill/${encodeURIComponent(route.path_id)}`;
    case "replay":
      return `#/case/${encodeURIComponent(route.case_id)}/replay/${encodeURIComponent(route.recording_id)}`;
    case "unknown":
      return route.address;
  }
}

export const route = signal<Route>({ room: "cases" });

export function followAddress(): void {
  const read = (): void => {
    route.value = parseRoute(location.hash);
  };
  addEventListener("hashchange", read);
  read();
}

/** The same place under another address, e.g. a path that has got its id: nothing for Back to return to. */
export function renameTo(next: Route): void {
  history.replaceState(null, "", addressOf(next));
  route.value = next;
}

export function goTo(next: Route): void {
  location.hash = addressOf(next);
}
