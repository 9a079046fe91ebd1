// A user's way through the rooms, in a real browser against the real server.
import { mkdtempSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { agreedCycle, keepPicture, kSlow_ms, launch, lookAt, openPage, readingOf, until } from "./browser";
import { type Served, serve, serveNothing, top } from "./served";

let served: Served;
let browser: Browser;
let page: Page;
let errors: string[];

beforeAll(async () => {
  served = await serve();
  browser = await launch();
  ({ page, errors } = await openPage(browser));
}, 5 * kSlow_ms);

afterAll(async () => {
  await browser?.close();
  await served?.stop();
});

afterEach(() => {
  expect(errors.splice(0), "errors in the page's console").toEqual([]);
});

const axe_source = readFileSync(
  createRequire(resolve(top, "web/package.json")).resolve("axe-core/axe.min.js"),
  "utf8",
);

interface AxeResult {
  violations: { id: string; impact: string | null; nodes: { html: string }[] }[];
}

/** WCAG A and AA, serious and critical. */
async function expectAccessible(): Promise<void> {
  // Through the debugger: the server's policy rightly allows no foreign script.
  await page.evaluate(axe_source);
  const found = await page.evaluate(() => {
    const axe = (globalThis as unknown as { axe: { run: (options: object) => Promise<AxeResult> } }).axe;
    return axe.run({ resultTypes: ["violations"] });
  });
  const bad = found.violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  expect(
    bad.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html.slice(0, 120)).join(" | ")}`),
  ).toEqual([]);
}

const reading = (name: string): Promise<number> => readingOf(page, name);

async function firstCase(): Promise<void> {
  await page.goto(`${served.address}/#/`);
  await page.locator(".case-card").first().click();
  await page.locator(".slice").first().waitFor();
}

describe("cases", () => {
  test("are listed and opened by keyboard", async () => {
    await page.goto(`${served.address}/#/`);
    const card = page.locator(".case-card").first();
    await card.waitFor();
    expect(await card.textContent()).toMatch(/Phantom L3.*reconstructed.*2 paths/);
    await expectAccessible();
    await keepPicture(page, "cases");
    await card.focus();
    await page.keyboard.press("Enter");
    await page.locator(".slice").first().waitFor();
    expect(page.url()).toMatch(/#\/case\/\w+$/);
  });

  test("an empty folder says what to type", async () => {
    const empty = await serveNothing(mkdtempSync(join(tmpdir(), "spinaltap-empty-")));
    try {
      await page.goto(`${empty.address}/#/`);
      await page.locator(".empty").waitFor();
      expect(await page.locator(".empty pre").textContent()).toContain("spinaltap import");
      await expectAccessible();
    } finally {
      await empty.stop();
    }
  });

  test("what is not there is said in words", async () => {
    await page.goto(`${served.address}/#/case/nosuchcase`);
    await page.locator('[role="alert"]').waitFor();
    expect(await page.locator('[role="alert"]').textContent()).toMatch(/could not be opened/);
    // The browser itself logs the 404 that the page has put into words.
    await page.waitForTimeout(100);
    expect(errors.splice(0).every((error) => /404/.test(error))).toBe(true);
  });
});

describe("a case", () => {
  test("shows the vertebra and its three slices", async () => {
    await firstCase();
    for (const plane of ["transaxial", "coronal", "sagittal"]) {
      const picture = page.locator(`.slice-${plane} canvas`);
      const look = await picture.evaluate((canvas: HTMLCanvasElement) => {
        const { data } = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
        let bright = 0;
        let dark = 0;
        for (let i = 0; i < data.length; i += 4) {
          if (data[i]! > 150) ++bright;
          if (data[i]! < 100) ++dark;
        }
        return { bright: (4 * bright) / data.length, dark: (4 * dark) / data.length };
      });
      // Cortex is bright in the bone window and a small part of the slice; soft tissue is dark and the most of it.
      expect(look.bright, plane).toBeGreaterThan(0.005);
      expect(look.bright, plane).toBeLessThan(0.4);
      expect(look.dark, plane).toBeGreaterThan(0.3);
    }
    await page.waitForTimeout(1000);
    const solid = await lookAt(page, page.locator(".scene-canvas"));
    expect(solid.busy, "the vertebra fills a part of the picture").toBeGreaterThan(0.2);
    expect(solid.bright, "and is lit").toBeGreaterThan(0.03);
    await expectAccessible();
    await keepPicture(page, "case");
  });

  test("its surface can be saved for other programs", async () => {
    await firstCase();
    const saved = async (name: string): Promise<Buffer> => {
      const link = page.getByRole("link", { name, exact: true });
      expect(await link.getAttribute("download"), "is saved, not shown").not.toBeNull();
      const answer = await page.request.get(`${served.address}${await link.getAttribute("href")}`);
      expect(answer.status()).toBe(200);
      expect(answer.headers()["content-disposition"]).toContain(`.${name.toLowerCase()}"`);
      return answer.body();
    };
    const stl = await saved("STL");
    const triangles = stl.readUInt32LE(80);
    expect(triangles).toBeGreaterThan(10_000);
    expect(stl.length).toBe(84 + 50 * triangles);
    const ply = await saved("PLY");
    expect(ply.subarray(0, 400).toString("latin1")).toContain(`element face ${triangles}\n`);
  });

  test("a click in one slice moves the others, and shows bone's HU", async () => {
    const slider = (plane: string) => page.getByLabel(`${plane} position`);
    const before = await slider("Coronal").inputValue();
    const box = (await page.locator(".slice-transaxial svg").boundingBox())!;
    await page.mouse.click(box.x + box.width * 0.5, box.y + box.height * 0.3);
    expect(await slider("Coronal").inputValue()).not.toBe(before);
    // Walk across the picture: somewhere there is cortex, somewhere soft tissue.
    const seen: number[] = [];
    for (let part = 0.2; part < 0.8; part += 0.02) {
      await page.mouse.move(box.x + box.width * part, box.y + box.height * 0.5);
      seen.push(Number(await page.locator(".slice-transaxial .slice-hu").getAttribute("data-hu")));
    }
    expect(Math.max(...seen)).toBeGreaterThan(300);
    expect(Math.min(...seen)).toBeLessThan(150);
  });

  test("the wheel and the arrow keys page and move", async () => {
    const slider = page.getByLabel("Transaxial position");
    const before = Number(await slider.inputValue());
    await page.locator(".slice-transaxial svg").hover();
    await page.mouse.wheel(0, 120);
    await until("the wheel turns a page", async () => Number(await slider.inputValue()) !== before);
    const sagittal = page.getByLabel("Sagittal position");
    const across = Number(await sagittal.inputValue());
    await page.locator(".slice-transaxial .slice-picture").focus();
    await page.keyboard.press("ArrowRight");
    expect(Number(await sagittal.inputValue())).toBeGreaterThan(across);
  });

  test("the other path can be chosen, and a reload keeps it", async () => {
    const facts_now = () => page.locator(".facts").first().textContent();
    const first = await facts_now();
    await page.locator(".path-card input").nth(1).check();
    await page.waitForURL(/\/path\//);
    await until("the other path's figures are shown", async () => (await facts_now()) !== first);
    const facts = await facts_now();
    await page.reload();
    await page.locator(".slice").first().waitFor();
    expect(await page.locator(".path-card input").nth(1).isChecked()).toBe(true);
    expect(await facts_now()).toBe(facts);
  });
});

/** Cycle and depth every `stride` cycles of the replay shown, until a depth is reached. */
async function depthsOfReplay(stride: number, until_mm: number): Promise<[number, number][]> {
  const found: [number, number][] = [];
  for (let cycle = stride; (found.at(-1)?.[1] ?? 0) < until_mm; cycle += stride) {
    const slider = page.getByLabel("Moment, in cycles");
    expect(cycle, "the depth is reached").toBeLessThan(Number(await slider.getAttribute("max")));
    await slider.fill(String(cycle));
    await page.locator(`.readings[data-cycle="${cycle}"]`).waitFor();
    found.push([cycle, await reading("Depth")]);
  }
  return found;
}

/** Cycles a millimetre, from the last place before one depth to the first past another. */
function slowness(places: [number, number][], from_mm: number, to_mm: number): number {
  const past = places.findIndex(([, depth]) => depth >= to_mm);
  const begun = places.findIndex(([, depth]) => depth > from_mm);
  const [first, last] = [places[begun - 1]!, places[past]!];
  return (last[0] - first[0]) / (last[1] - first[1]);
}

/** Waits in the page itself, so that it is seen at once. */
async function deeperThan(drilling: Page, depth_mm: number): Promise<void> {
  const is_deeper = (wanted: number): boolean =>
    Number(document.querySelector('[data-reading="Depth"]')?.textContent) > wanted;
  await drilling.waitForFunction(is_deeper, depth_mm, { polling: 10 });
}

/** Of the drill that is finished, as the page saw it. */
let agreed = 0;

describe("a drill", () => {
  test("whose bit stands still cuts nothing: bone stops it, however hard the push", async () => {
    await firstCase();
    await page.getByText("Drill this path").click();
    await page.locator('[data-agreement="agrees"]').waitFor();
    await page.getByLabel("Keys push").selectOption("30");
    await page.locator("main").focus();
    await page.keyboard.press("Space");
    await page.getByText("Bit stands still").waitFor();
    await page.keyboard.down("KeyW");
    await until("all of the push is felt", async () => (await reading("Thrust")) > 29);
    expect(await reading("Thrust")).toBeLessThan(31);
    expect(await reading("Depth"), "on the bone, whose outside is within 3 mm of the entry").toBeLessThan(3);
    await page.keyboard.up("KeyW");
    await until("nothing is felt", async () => Math.abs(await reading("Thrust")) < 0.1);
    expect(await reading("Bone removed")).toBe(0);
    await page.keyboard.press("Space");
    await page.getByText("Bit is turning").waitFor();
  });

  test("is pushed by a key, and bone pushes back", async () => {
    await page.keyboard.down("KeyW");
    let peak = 0;
    await until("the bit is deep in the cortex", async () => {
      peak = Math.max(peak, await reading("Thrust"));
      return (await reading("Depth")) > 4.5;
    });
    // Behind it the bit is fast: let go as soon as the page shows it.
    await deeperThan(page, 8);
    await page.keyboard.up("KeyW");
    expect(peak, "the cortex took nearly all of the push").toBeGreaterThan(20);
    expect(peak).toBeLessThan(35);
    // At least half of a cone of 5 mm, pi * 1.5^2 * 5 / 3 = 11.8 mm3, and the bit went on.
    expect(await reading("Bone removed")).toBeGreaterThan(6);
    // But for what the hole's rubbing holds, where the chuck met the bone.
    await until("let go, nothing pushes any more", async () => Math.abs(await reading("Thrust")) < 2);
    expect(await page.getByRole("meter", { name: "Push, N" }).getAttribute("aria-valuenow")).toBe("0");
    await page.waitForTimeout(1500);
    await keepPicture(page, "drill");
    await expectAccessible();
  });

  test("the curve of the last seconds shows push and force", async () => {
    const colours = await page.locator(".force-chart canvas").evaluate((canvas: HTMLCanvasElement) => {
      const { data } = canvas.getContext("2d")!.getImageData(0, 0, canvas.width, canvas.height);
      let push = 0;
      let felt = 0;
      for (let i = 0; i < data.length; i += 4) {
        if (data[i + 3]! < 128) continue;
        push += Number(data[i]! > 180 && data[i + 2]! < 110);
        felt += Number(data[i]! < 110 && data[i + 2]! > 160);
      }
      return { push, felt };
    });
    expect(colours.push).toBeGreaterThan(50);
    expect(colours.felt).toBeGreaterThan(50);
  });

  test("the pad pulls it out", async () => {
    const pad = (await page.locator('[data-pad="tall"]').boundingBox())!;
    await page.mouse.move(pad.x + pad.width / 2, pad.y + pad.height / 2);
    await page.mouse.down();
    await page.mouse.move(pad.x + pad.width / 2, pad.y + 4, { steps: 3 });
    // Where it began, 6 mm outside the lead, the arm is drawn back fully: the bit stays in the picture. The stop gives
    // way by 6 N over 20 N/mm.
    await until("the bit is out of the bone", async () => (await reading("Depth")) < -8);
    await page.waitForTimeout(1000);
    expect(await reading("Depth")).toBeGreaterThan(-12);
    await page.mouse.up();
  });

  test("the pointer on the bit moves it: a drag aims, the wheel pushes", async () => {
    const canvas = page.locator(".scene-canvas canvas");
    const box = (await canvas.boundingBox())!;
    const cursor = () => canvas.evaluate((element: HTMLCanvasElement) => element.style.cursor);
    const drawn = () =>
      page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    const findBit = async (): Promise<{ x: number; y: number }> => {
      const cycles = page.locator('[data-reading="Cycles"]');
      await until("it stands", async () => (await cycles.textContent()) === "idle");
      for (let part = 0.5; part < 0.95; part += 0.03) {
        const at = { x: box.x + box.width * part, y: box.y + box.height * (part + 0.05) };
        await page.mouse.move(at.x, at.y);
        await drawn(); // the browser tells of a pointer's moves once a frame
        if ((await cursor()) === "grab") return at;
      }
      throw new Error("the bit is not found in the picture");
    };
    const at = await findBit();
    const slice = page.locator(".slice-sagittal .slice-name");
    const side = await slice.textContent();
    await page.mouse.down();
    await page.mouse.move(at.x + 12, at.y - 12, { steps: 4 });
    await page.mouse.up();
    await until("the drag has moved it sideways", async () => (await slice.textContent()) !== side);
    await findBit();
    const depth = await reading("Depth");
    await page.mouse.wheel(0, 120);
    await until("a notch has pushed it in", async () => (await reading("Depth")) > depth + 0.2);
    const push = page.getByRole("meter", { name: "Push, N" });
    await until("and fades", async () => (await push.getAttribute("aria-valuenow")) === "0");
  });

  test("the sound is off until it is asked for, by button or key", async () => {
    const off = page.getByRole("button", { name: "Sound is off" });
    const on = page.getByRole("button", { name: "Sound is on" });
    expect(await off.getAttribute("aria-pressed")).toBe("false");
    await off.click();
    expect(await on.getAttribute("aria-pressed")).toBe("true");
    await page.keyboard.press("m");
    await off.waitFor();
  });

  test("the cut-away opens the bone, and closes again", async () => {
    const scene = page.locator(".scene-canvas");
    const closed = await lookAt(page, scene);
    expect(closed.marrow).toBeLessThan(0.02);
    const cut_away = page.getByRole("button", { name: "Cut-away" });
    await cut_away.click();
    await until("marrow shows", async () => (await lookAt(page, scene)).marrow > 0.1);
    await keepPicture(page, "cut-away");
    await cut_away.click();
    await until("it shows no more", async () => (await lookAt(page, scene)).marrow < 0.02);
  });

  test("finishes: the server keeps the recording and gives the metrics", async () => {
    await page.getByRole("button", { name: "Finish the drill" }).click();
    await page.locator(".finished").waitFor();
    expect(await page.locator('[data-metric="peak_thrust_N"] .number').textContent()).toMatch(/^\d/);
    expect(await page.locator(".finished code").textContent()).toMatch(/^\w+$/);
    // Every hash that the server sent, to the last, was this page's own.
    agreed = await agreedCycle(page);
    expect(agreed).toBeGreaterThan(1000);
    await expectAccessible();
    await keepPicture(page, "finished");
  });
});

describe("a replay", () => {
  test("of what the server kept is verified, and plays the drill again", async () => {
    await page.locator(".finished").getByRole("link", { name: "Replay" }).click();
    await page.locator('[data-verified="true"]').waitFor();
    const slider = page.getByLabel("Moment, in cycles");
    // Hashes come every 16 cycles: what was compared is all of what was kept but for fewer.
    const cycles = async () => Number(await slider.getAttribute("max"));
    await until("the slider has the drill's length", async () => (await cycles()) >= agreed);
    expect(await cycles()).toBeLessThan(agreed + 16);
    await until("the end is shown", async () => (await reading("Bone removed")) > 6);
    await page.waitForTimeout(1500);
    await expectAccessible();
    await keepPicture(page, "replay");
  });

  test("shows that under the same push hard bone held the bit up, and soft bone let it go", async () => {
    const places = await depthsOfReplay(400, 8.5);
    // Stepped without a page: 1000 cycles a mm under 30 N from 4.5 to 6 mm, and 27 behind 8 mm. Places 400 cycles apart
    // blur the latter, and part of what is between is in it.
    expect(slowness(places, 4.5, 5.5)).toBeGreaterThan(4 * slowness(places, 6.5, 8.5));
  });

  test("the slider moves the moment, forth and back", async () => {
    const slider = page.getByLabel("Moment, in cycles");
    const isShown = (cycle: string) => page.locator(`.readings[data-cycle="${cycle}"]`).waitFor();
    const last = (await slider.getAttribute("max"))!;
    await slider.focus();
    await page.keyboard.press("End");
    await isShown(last);
    const end = await reading("Bone removed");
    await page.keyboard.press("Home");
    await isShown("0");
    expect(await reading("Bone removed"), "nothing is cut yet").toBe(0);
    expect(await reading("Depth")).toBeLessThanOrEqual(0);
    await page.keyboard.press("End");
    await isShown(last);
    expect(await reading("Bone removed"), "all is cut again").toBe(end);
  });

  test("plays by itself", async () => {
    await page.getByLabel("Moment, in cycles").focus();
    await page.keyboard.press("Home");
    await page.getByRole("button", { name: "Play" }).click();
    await until(
      "time passes",
      async () => Number(await page.getByLabel("Moment, in cycles").inputValue()) > 300,
    );
    await page.getByRole("button", { name: "Pause" }).click();
  });

  test("is found again from the case, and after a reload", async () => {
    const address = page.url();
    await page.reload();
    await page.locator('[data-verified="true"]').waitFor();
    await firstCase();
    const link = page.locator(`.recording-list a[href="${new URL(address).hash}"]`);
    expect(await link.textContent()).toContain("Replay");
  });
});

describe("the README's picture", () => {
  const file = process.env.SPINALTAP_SCREENSHOT;
  test.skipIf(!file)("is made again", async () => {
    const { page: large } = await openPage(browser, 1440, 900);
    await large.goto(`${served.address}/#/`);
    await large.locator(".case-card").first().click();
    await large.getByText("Drill this path").click();
    await large.locator('[data-agreement="agrees"]').waitFor();
    await large.getByLabel("Keys push").selectOption("30");
    await large.getByRole("button", { name: "Cut-away" }).click();
    await large.keyboard.down("KeyW");
    await large.locator("main").focus();
    await deeperThan(large, 10);
    await large.keyboard.up("KeyW");
    await large.locator('[data-reading="Cycles"]', { hasText: "idle" }).waitFor();
    await large.screenshot({ path: resolve(top, file!), timeout: kSlow_ms });
    await large.context().close();
  });
});

describe("without the server", () => {
  test("a drill goes on alone, says so, and can be replayed here", async () => {
    await firstCase();
    await page.route("**/api/v1/sessions", (route) => route.abort());
    await page.getByText("Drill this path").click();
    await page.locator('[data-agreement="offline"]').waitFor();
    await page.getByLabel("Keys push").selectOption("20");
    await page.locator("main").focus();
    await page.keyboard.down("KeyW");
    await until("bone is cut", async () => (await reading("Bone removed")) > 2);
    await page.keyboard.up("KeyW");
    await page.getByRole("button", { name: "Finish the drill" }).click();
    await page.locator(".finished").getByRole("link", { name: "Replay" }).click();
    await page.locator('[data-verified="true"]').waitFor();
    await page.unroute("**/api/v1/sessions");
    // The browser logs the request that the test cut.
    expect(errors.splice(0).every((error) => /ERR_FAILED/.test(error))).toBe(true);
  });
});
