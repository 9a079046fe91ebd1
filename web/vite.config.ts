// The pages. Nothing generated lies in this folder: pages go to build/web/dist, caches to build/web.
import { resolve } from "node:path";
import { defineConfig } from "vite";

const top = resolve(import.meta.dirname, "..");
const wasm_dir = resolve(process.env.SPINALTAP_WASM_DIR ?? `${top}/build/wasm/bin`);

export default defineConfig({
  base: "./",
  cacheDir: `${top}/build/web/vite`,
  // The compiled core is taken in as two files with hashed names, so that they may be cached for ever.
  resolve: { alias: { "@core": wasm_dir } },
  assetsInclude: ["**/*.wasm"],
  worker: { format: "es" },
  build: {
    outDir: `${top}/build/web/dist`,
    emptyOutDir: true,
    target: "es2022",
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 900,
  },
  server: {
    proxy: { "/api": "http://127.0.0.1:8080", "/ws": { target: "ws://127.0.0.1:8080", ws: true } },
    fs: { allow: [top] },
  },
});
