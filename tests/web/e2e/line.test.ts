// A drill whose line to the server breaks: in a real browser, over a TCP connection that is really cut.
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { agreedCycle, kSlow_ms, launch, openPage, readingOf, until } from "./browser";
import { type CuttableLine, proxyTo } from "./proxy";
import { type Served, serve } from "./served";

let served: Served;
let proxy: CuttableLine;
let browser: Browser;
let page: Page;
let errors: string[];

beforeAll(async () => {
  served = await serve();
  proxy = await proxyTo(served.address);
  browser = await launch();
  ({ page, errors } = await openPage(browser));
}, 5 * kSlow_ms);

afterAll(async () => {
  await browser?.close();
  await proxy?.stop();
  await served?.stop();
});

afterEach(() => {
  // The browser logs each WebSocket that the test cut.
  expect(errors.splice(0).filter((error) => !/WebSocket connection to/.test(error))).toEqual([]);
});

const badge = (kind: string): Promise<void> => page.locator(`[data-agreement="${kind}"]`).waitFor();

/** That the drill has gone through. */
async function cycles(): Promise<number> {
  const text = (await page.locator(".reading-note").first().textContent())!;
  return Number(text.match(/([\d,]+) cycles/)![1]!.replaceAll(",", ""));
}
const agreesPast = (cycle: number): Promise<void> =>
  until(`the server agrees past cycle ${cycle}`, async () => (await agreedCycle(page)) > cycle);
const drillsOn = async (more: number): Promise<void> => {
  const from = await cycles();
  await until("the drill goes on", async () => (await cycles()) > from + more);
};

async function beginDrill(): Promise<void> {
  await page.goto(`${proxy.address}/#/`);
  await page.locator(".case-card").first().click();
  await page.getByText("Drill this path").click();
  await badge("agrees");
  await page.getByLabel("Keys push").selectOption("20");
  await page.locator("main").focus();
  await page.keyboard.down("KeyW");
  await until("bone is cut", async () => (await readingOf(page, "Bone removed")) > 0.5);
}

describe("a drill whose line breaks", () => {
  test("goes on, and all of it is on the server when the line is back", async () => {
    await beginDrill();
    proxy.cut();
    await badge("reconnecting");
    await drillsOn(300);
    proxy.heal();
    await agreesPast(await cycles());
    expect(proxy.sockets()).toBeGreaterThan(1);
  });

  test("in the middle of a message, too", async () => {
    const before = proxy.sockets();
    proxy.cutAfter(37); // some of a batch's first pose
    await until("it has called again", async () => proxy.sockets() > before);
    await agreesPast(await cycles());
    await page.keyboard.up("KeyW");
  });

  test("ends as one recording that is complete, and verified", async () => {
    await page.getByRole("button", { name: "Finish the drill" }).click();
    const id = await page.locator(".finished code").textContent();
    const total = await cycles();
    expect(await agreedCycle(page), "hashes come every 16 cycles").toBeGreaterThan(total - 16);
    const case_id = page.url().match(/#\/case\/(\w+)/)![1]!;
    const answer = await page.request.get(`${served.address}/api/v1/cases/${case_id}`);
    const { recordings } = (await answer.json()) as {
      recordings: { id: string; cycles: number; complete: boolean }[];
    };
    expect(recordings.find((recording) => recording.id === id)).toMatchObject({
      complete: true,
      cycles: total,
    });
    await page.locator(".finished").getByRole("link", { name: "Replay" }).click();
    await page.locator('[data-verified="true"]').waitFor();
  });

  test("for good can be finished without the server", async () => {
    await beginDrill();
    proxy.cut();
    await badge("reconnecting");
    await page.keyboard.up("KeyW");
    await page.getByRole("button", { name: "Finish the drill" }).click();
    await page.getByRole("button", { name: "Finish without the server" }).click();
    await badge("offline");
    await page.locator(".finished").waitFor();
    proxy.heal();
    await page.locator(".finished").getByRole("link", { name: "Replay" }).click();
    await page.locator('[data-verified="true"]').waitFor();
  });
});
