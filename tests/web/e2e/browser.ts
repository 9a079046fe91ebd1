// Debian's Chromium, without a screen, drawing in software.
import { mkdirSync } from "node:fs";
import { resolve } from "node:path";
import { type Browser, chromium, type Locator, type Page } from "playwright-core";
import { top } from "./served";

export const kSlow_ms = 120_000;
const screenshots = resolve(top, "build/screenshots");

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: process.env.SPINALTAP_CHROMIUM ?? "/usr/bin/chromium",
    args: [
      "--no-sandbox",
      "--disable-background-networking",
      "--disable-quic",
      "--disable-sync",
      "--disable-component-update",
      "--no-first-run",
      "--use-gl=angle",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
    ],
  });
}

/** A page that fails the test on any error in its console. Still pictures: nothing turns by itself. */
export async function openPage(
  browser: Browser,
  width = 1280,
  height = 800,
): Promise<{ page: Page; errors: string[] }> {
  const context = await browser.newContext({
    viewport: { width, height },
    reducedMotion: "reduce",
    locale: "en-GB",
  });
  const page = await context.newPage();
  page.setDefaultTimeout(kSlow_ms);
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  return { page, errors };
}

export async function readingOf(page: Page, name: string): Promise<number> {
  return Number((await page.locator(`[data-reading="${name}"]`).textContent())!.replaceAll(",", ""));
}

/** Waits until `probe` is true, asking a few times a second. */
export async function until(what: string, probe: () => Promise<boolean>): Promise<void> {
  for (const end = Date.now() + kSlow_ms; Date.now() < end; ) {
    if (await probe()) return;
    await new Promise((done) => setTimeout(done, 200));
  }
  throw new Error(`waited in vain until ${what}`);
}

/** The last cycle at which the server's hash was the page's own; 0 while nothing was compared. */
export async function agreedCycle(page: Page): Promise<number> {
  const text = (await page.locator("[data-agreement]").textContent())!;
  return Number(text.match(/agrees at cycle ([\d,]+)/)?.[1]?.replaceAll(",", "") ?? 0);
}

export async function keepPicture(page: Page, name: string): Promise<void> {
  mkdirSync(screenshots, { recursive: true });
  await page.screenshot({ path: resolve(screenshots, `${name}.png`), timeout: kSlow_ms });
}

export interface Look {
  /** Of 0 .. 255. */
  mean: number;
  deviation: number;
  /** Share of pixels lighter than 160. */
  bright: number;
  /** Share of pixels that are not within 6 of the commonest grey. */
  busy: number;
  /** Share of pixels as red as opened marrow; the bone's outside never is. */
  marrow: number;
}

/** What an element looks like, from a picture of the page: drawn pixels, not promises. */
export async function lookAt(page: Page, element: Locator): Promise<Look> {
  const png = await element.screenshot({ timeout: kSlow_ms });
  return page.evaluate(async (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const canvas = new OffscreenCanvas(image.width, image.height);
    const context = canvas.getContext("2d")!;
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const counts = new Array<number>(256).fill(0);
    let red = 0;
    for (let i = 0; i < data.length; i += 4) {
      red += Number(data[i]! - data[i + 2]! > 55);
      counts[Math.round(0.3 * data[i]! + 0.59 * data[i + 1]! + 0.11 * data[i + 2]!)]! += 1;
    }
    const pixels = data.length / 4;
    const sum = (of: (grey: number) => number): number =>
      counts.reduce((total, count, grey) => total + count * of(grey), 0) / pixels;
    const mean = sum((grey) => grey);
    const commonest = counts.indexOf(Math.max(...counts));
    return {
      mean,
      deviation: Math.sqrt(sum((grey) => (grey - mean) ** 2)),
      bright: sum((grey) => Number(grey > 160)),
      busy: sum((grey) => Number(Math.abs(grey - commonest) > 6)),
      marrow: red / pixels,
    };
  }, png.toString("base64"));
}
