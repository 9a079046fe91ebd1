// Builds the pages into ../build/web/dist, with the core from SPINALTAP_WASM_DIR (default ../build/wasm/bin).
import { existsSync } from "node:fs";
import { resolve } from "node:path";
import { build } from "vite";

const wasm_dir = resolve(process.env.SPINALTAP_WASM_DIR ?? resolve(import.meta.dirname, "../build/wasm/bin"));
for (const name of ["spinaltap_core.mjs", "spinaltap_core.wasm"]) {
  if (!existsSync(resolve(wasm_dir, name))) {
    console.error(`web: ${name} is not in SPINALTAP_WASM_DIR; build the WebAssembly preset first`);
    process.exit(1);
  }
}
await build({ root: import.meta.dirname, logLevel: process.env.CI ? "warn" : "info" });
