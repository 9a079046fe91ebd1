// End to end: the built pages in Chromium against the built program. See tests/web/README.md.
import { resolve } from "node:path";
import { defineConfig } from "vitest/config";

const top = resolve(import.meta.dirname, "..");
const modules = resolve(import.meta.dirname, "node_modules");

export default defineConfig({
  cacheDir: `${top}/build/web/vitest`,
  resolve: { alias: { "playwright-core": resolve(modules, "playwright-core/index.mjs") } },
  test: {
    root: top,
    include: ["tests/web/e2e/**/*.test.ts"],
    environment: "node",
    testTimeout: 240_000,
    hookTimeout: 600_000,
    // One browser at a time; a room's tests go on from one another.
    fileParallelism: false,
    sequence: { concurrent: false },
    bail: 1,
  },
  server: { fs: { allow: [top] } },
});
