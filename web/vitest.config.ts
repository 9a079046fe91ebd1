import { resolve } from "node:path";
import { defineConfig } from "vitest/config";

const top = resolve(import.meta.dirname, "..");

export default defineConfig({
  cacheDir: `${top}/build/web/vitest`,
  resolve: {
    alias: {
      "@web": resolve(import.meta.dirname, "src"),
      "@core": resolve(top, "tests/web/fixtures/no_core"),
    },
  },
  test: { root: top, include: ["tests/web/unit/**/*.test.ts"], environment: "node" },
  server: { fs: { allow: [top] } },
});
