// Something that is being fetched, is here, or could not be had.
import { type Signal, useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";

export type Loaded<T> =
  | { state: "loading" }
  | { state: "ready"; value: T }
  | { state: "failed"; message: string };

export function messageOf(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** Starts `fetcher` when the component appears or `key` changes; what arrives late for an old key is dropped. */
export function useLoaded<T>(key: string, fetcher: () => Promise<T>): Signal<Loaded<T>> {
  const loaded = useSignal<Loaded<T>>({ state: "loading" });
  useEffect(() => {
    let current = true;
    loaded.value = { state: "loading" };
    fetcher().then(
      (value) => {
        if (current) loaded.value = { state: "ready", value };
      },
      (error) => {
        if (current) loaded.value = { state: "failed", message: messageOf(error) };
      },
    );
    return () => {
      current = false;
    };
  }, [key]);
  return loaded;
}
