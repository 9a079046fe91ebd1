// Fetches and starts the compiled core, once a worker.
import core_url from "@core/spinaltap_core.mjs?url";
import wasm_url from "@core/spinaltap_core.wasm?url";
import type { Core } from "./core_api";

let core: Promise<Core> | null = null;

export function loadCore(): Promise<Core> {
  core ??= start();
  return core;
}

async function start(): Promise<Core> {
  const module = await import(/* @vite-ignore */ new URL(core_url, self.location.href).href);
  const options = { locateFile: () => new URL(wasm_url, self.location.href).href };
  return (await module.default(options)) as Core;
}
