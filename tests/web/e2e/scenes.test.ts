// The scenes in Chromium: the same hashes as natively (tests/scenes/golden).
import { mkdtempSync, readdirSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { kSlow_ms, launch, openPage } from "./browser";
import { pages, type Served, serveNothing, top } from "./served";

interface Core {
  runScene: (
    name: string,
    engine: string,
    cycles: number,
    discs: number,
  ) => { hash: string; removed: number };
}

let served: Served;
let browser: Browser;
let page: Page;

beforeAll(async () => {
  served = await serveNothing(mkdtempSync(join(tmpdir(), "spinaltap-scenes-")));
  browser = await launch();
  ({ page } = await openPage(browser));
  await page.goto(`${served.address}/#/`);
  const asset = (pattern: RegExp): string =>
    `/assets/${readdirSync(resolve(pages, "assets")).find((name) => pattern.test(name))}`;
  // As text, since the test runner rewrites imports in functions.
  await page.evaluate(
    `import("${asset(/^spinaltap_core.*\.mjs$/)}")
      .then(({ default: create }) => create({ locateFile: () => "${asset(/^spinaltap_core.*\.wasm$/)}" }))
      .then((core) => void (globalThis.core = core))`,
  );
}, kSlow_ms);

afterAll(async () => {
  await browser?.close();
  await served?.stop();
});

const golden = readFileSync(resolve(top, "tests/scenes/golden/scenes.csv"), "utf8")
  .split("\n")
  .map((line) => line.trim().split(","))
  // The program's engine in full, the others where they are quick.
  .filter(
    ([scene, engine, , , , , runs]) =>
      /^(on|off|hand)$/.test(scene!) && (runs === "short" || engine === "clearance"),
  );

describe("scenes in Chromium", () => {
  test("there are golden scenes to compare with", () => {
    expect(golden.length).toBeGreaterThanOrEqual(6);
  });

  test.each(golden)(
    "%s by %s, %s discs, %s cycles, has the golden hash",
    async (scene, engine, discs, cycles, hash, removed) => {
      const result = await page.evaluate(
        ([name, by, steps, layers]) =>
          (globalThis as unknown as { core: Core }).core.runScene(name!, by!, Number(steps), Number(layers)),
        [scene, engine, cycles, discs],
      );
      expect(result).toMatchObject({ hash, removed: Number(removed) });
    },
    kSlow_ms,
  );
});
