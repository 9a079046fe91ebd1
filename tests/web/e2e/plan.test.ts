// Plan: a path is dragged in a slice and in 3-D, moved by keys, undone, saved, found again after a reload, and drilled.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import type { Browser, Locator, Page } from "playwright-core";
import { afterAll, afterEach, beforeAll, describe, expect, test } from "vitest";
import { keepPicture, kSlow_ms, launch, lookAt, openPage, until } from "./browser";
import { type Served, serveCopy, top } from "./served";

type Vec3 = [number, number, number];
interface PathInfo {
  id: string;
  label: string;
  entry_patient: Vec3;
  target_patient: Vec3;
  bit: { diameter_mm: number; length_mm: number };
  length_mm: number;
}

let served: Served;
let browser: Browser;
let page: Page;
let errors: string[];
let case_id: string;

beforeAll(async () => {
  served = await serveCopy();
  browser = await launch();
  ({ page, errors } = await openPage(browser));
  const answer = await page.request.get(`${served.address}/api/v1/cases`);
  case_id = ((await answer.json()) as { cases: { id: string }[] }).cases[0]!.id;
  // Points 0.2 mm apart, not 0.1, are made in an eighth of the time.
  const { id, label, entry_patient, target_patient, bit } = await pathAtServer("left pedicle");
  const coarse = { label, entry_patient, target_patient, bit, spacing_mm: 0.2 };
  const put = await page.request.put(`${served.address}/api/v1/cases/${case_id}/paths/${id}`, {
    data: coarse,
  });
  expect(put.status()).toBe(200);
}, 5 * kSlow_ms);

afterAll(async () => {
  await browser?.close();
  await served?.stop();
});

afterEach(() => {
  expect(errors.splice(0), "errors in the page's console").toEqual([]);
});

async function pathsAtServer(): Promise<PathInfo[]> {
  const answer = await page.request.get(`${served.address}/api/v1/cases/${case_id}`);
  return ((await answer.json()) as { paths: PathInfo[] }).paths;
}
async function pathAtServer(label: string): Promise<PathInfo> {
  return (await pathsAtServer()).find((path) => path.label === label)!;
}

const kSaved = '[data-save="saved"]';
const slice = (name: string): Locator => page.getByRole("region", { name: `${name} slice` });
const handle = (where: Locator, end: "Entry" | "Target"): Locator =>
  where.getByRole("button", { name: new RegExp(`^${end} of`) });

/** The numbers in a handle's name, as it tells them: "L 21.4  P 38.0  H 10.2 mm". */
async function toldBy(handle_of: Locator): Promise<Vec3> {
  const name = (await handle_of.getAttribute("aria-label"))!;
  const found = [...name.matchAll(/([LRPAHF]) (\d+\.\d)/g)];
  return found.map(([, letter, size]) => (/[RAF]/.test(letter!) ? -1 : 1) * Number(size)) as Vec3;
}

async function dragBy(what: Locator, right_px: number, down_px: number): Promise<void> {
  const box = (await what.boundingBox())!;
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= 4; ++i) await page.mouse.move(x + (right_px * i) / 4, y + (down_px * i) / 4);
  await page.mouse.up();
}

async function mmPerPixel(name: string): Promise<number> {
  const svg = slice(name).locator("svg");
  // Ten millimetres are drawn as a bar.
  return svg.evaluate((element: SVGSVGElement) => {
    const bar = element.querySelector(".scale-bar")!.getBoundingClientRect();
    return 10 / bar.width;
  });
}

/** Of the chosen path: the cross-section of its hole in a slice, as it is drawn. */
const holeIn = (name: string): Promise<string | null> =>
  slice(name)
    .locator(".mark-hole")
    .getAttribute("points", { timeout: 1000 })
    .catch(() => null);

const axe_source = readFileSync(
  createRequire(resolve(top, "web/package.json")).resolve("axe-core/axe.min.js"),
  "utf8",
);
interface AxeResult {
  violations: { id: string; impact: string | null; nodes: { html: string }[] }[];
}

describe("a path", () => {
  let before: PathInfo;

  test("is dragged by its target in a slice, and its hole goes along in every slice", async () => {
    await page.goto(`${served.address}/#/case/${case_id}`);
    await page.getByRole("radio", { name: "left pedicle" }).check();
    await page.locator(kSaved).waitFor();
    await until("the handles are there", async () => (await page.locator(".handle").count()) === 8);
    before = await pathAtServer("left pedicle");
    const told = await toldBy(handle(slice("Transaxial"), "Target"));
    for (let a = 0; a < 3; ++a) expect(told[a]).toBeCloseTo(before.target_patient[a]!, 1);
    const mm = await mmPerPixel("Transaxial");
    const holes = await Promise.all(["Transaxial", "Coronal", "Sagittal"].map(holeIn));
    await dragBy(handle(slice("Transaxial"), "Target"), 24, -16);
    const after = await toldBy(handle(slice("Transaxial"), "Target"));
    // Whole CSS pixels, told to a tenth of a millimetre.
    expect(after[0]).toBeCloseTo(before.target_patient[0] + 24 * mm, 0);
    expect(after[1]).toBeCloseTo(before.target_patient[1] - 16 * mm, 0);
    expect(after[2]).toBeCloseTo(before.target_patient[2], 1);
    expect(await toldBy(handle(page.locator(".scene"), "Target")), "3-D tells the same").toEqual(after);
    const moved = await Promise.all(["Transaxial", "Coronal", "Sagittal"].map(holeIn));
    expect(moved.some((hole) => hole !== null)).toBe(true);
    moved.forEach((hole, i) => {
      if (hole !== null) expect(hole).not.toBe(holes[i]);
    });
    await page.getByText("Drill this path, once it is saved").waitFor();
  });

  test("is saved by itself, with the points along it made anew", async () => {
    await page.locator(kSaved).waitFor();
    const kept = await pathAtServer("left pedicle");
    expect(kept.id).toBe(before.id);
    expect(kept.target_patient).not.toEqual(before.target_patient);
    const told = await toldBy(handle(slice("Coronal"), "Target"));
    for (let a = 0; a < 3; ++a) expect(told[a]).toBeCloseTo(kept.target_patient[a]!, 1);
  });

  test("is undone in one step and done again, by key and by button, and each is saved", async () => {
    const dragged = await pathAtServer("left pedicle");
    await page.locator("main").focus();
    await page.keyboard.press("Control+z");
    expect(await page.getByRole("button", { name: "Undo" }).isDisabled()).toBe(true);
    await until("the server has what was", async () => {
      const { target_patient } = await pathAtServer("left pedicle");
      return target_patient.join() === before.target_patient.join();
    });
    await page.getByRole("button", { name: "Redo" }).click();
    await until("the server has what was done again", async () => {
      const { target_patient } = await pathAtServer("left pedicle");
      return target_patient.join() === dragged.target_patient.join();
    });
    await page.locator(kSaved).waitFor();
  });

  test("is moved by arrow keys on a handle: half a millimetre, a tenth with Shift", async () => {
    const entry = handle(slice("Coronal"), "Entry");
    const from = await toldBy(entry);
    await entry.focus();
    for (let i = 0; i < 4; ++i) await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowDown");
    for (let i = 0; i < 3; ++i) await page.keyboard.press("Shift+ArrowLeft");
    const to = await toldBy(entry);
    expect(to[0]).toBeCloseTo(from[0] + 4 * 0.5 - 3 * 0.1, 5);
    expect(to[1]).toBe(from[1]);
    expect(to[2]).toBeCloseTo(from[2] - 0.5, 5);
    expect(await page.evaluate(() => document.activeElement?.getAttribute("data-end"))).toBe("entry");
  });

  test("is dragged in 3-D, in the plane of the screen", async () => {
    const entry = handle(page.locator(".scene"), "Entry");
    const from = await entry.boundingBox();
    await dragBy(entry, -18, 12);
    await until("the handle is where it was dragged to", async () => {
      const box = (await entry.boundingBox())!;
      return Math.abs(box.x - from!.x + 18) < 1.5 && Math.abs(box.y - from!.y - 12) < 1.5;
    });
    for (const box of await page.locator(".handle").all())
      expect((await box.boundingBox())!.width).toBeGreaterThanOrEqual(24);
  });

  test("is dragged by touch as by the mouse", async () => {
    const target = handle(slice("Sagittal"), "Target");
    const from = await toldBy(target);
    const box = (await target.boundingBox())!;
    const mm = await mmPerPixel("Sagittal");
    const finger = await page.context().newCDPSession(page);
    const touch = (type: "touchStart" | "touchMove" | "touchEnd", up_px: number) =>
      finger.send("Input.dispatchTouchEvent", {
        type,
        touchPoints:
          type === "touchEnd" ? [] : [{ x: box.x + box.width / 2, y: box.y + box.height / 2 - up_px }],
      });
    await touch("touchStart", 0);
    for (const up_px of [3, 6, 10]) await touch("touchMove", up_px);
    await touch("touchEnd", 10);
    await finger.detach();
    const to = await toldBy(target);
    // Told to a tenth of a millimetre, before and after.
    expect(Math.abs(to[2] - (from[2] + 10 * mm))).toBeLessThan(0.11);
    expect(Math.abs(to[1] - from[1])).toBeLessThan(0.11);
    expect(to[0]).toBe(from[0]);
  });

  test("takes another bit, by name and by number", async () => {
    await page.locator(".bit-fields select").selectOption("Screw 6.5 × 45 mm");
    await page.getByLabel("Length, mm").fill("99");
    await page.keyboard.press("Enter");
    expect(await page.getByLabel("Length, mm").inputValue()).toBe("60");
    await page.getByLabel("Name").fill("left, wide");
    await page.keyboard.press("Enter");
    await until("it is saved", async () => (await pathAtServer("left, wide"))?.bit.length_mm === 60);
    expect((await pathAtServer("left, wide")).bit.diameter_mm).toBe(6.5);
    await page.locator(kSaved).waitFor();
  });

  test("is found again after a reload, under the same address", async () => {
    const kept = await pathAtServer("left, wide");
    expect(page.url()).toContain(`/path/${kept.id}`);
    await page.reload();
    await page.getByRole("radio", { name: "left, wide" }).and(page.locator(":checked")).waitFor();
    const told = await toldBy(handle(slice("Sagittal"), "Entry"));
    for (let a = 0; a < 3; ++a) expect(told[a]).toBeCloseTo(kept.entry_patient[a]!, 1);
    await keepPicture(page, "plan");
  });
});

describe("the room", () => {
  test("has no serious violation of accessibility", async () => {
    await page.evaluate(axe_source);
    const found = await page.evaluate(() => {
      const axe = (globalThis as unknown as { axe: { run: (options: object) => Promise<AxeResult> } }).axe;
      return axe.run({
        resultTypes: ["violations"],
        runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"],
      });
    });
    expect(
      found.violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120))}`),
    ).toEqual([]);
  });

  test("shows the CT through the window of a key, of a button, and of a drag", async () => {
    const now = (): Promise<string | null> => page.locator("[data-window]").getAttribute("data-window");
    const canvas = slice("Transaxial").locator("canvas");
    const bone = await lookAt(page, canvas);
    await page.locator("main").focus();
    await page.keyboard.press("1");
    expect(await now()).toBe("400/40");
    const soft = page.getByRole("button", { name: "Soft tissue" });
    expect(await soft.getAttribute("aria-pressed")).toBe("true");
    expect((await lookAt(page, canvas)).bright).toBeGreaterThan(bone.bright);
    await page.getByRole("button", { name: "Bone 2500/480" }).click();
    expect(await now()).toBe("2500/480");
    const box = (await slice("Transaxial").locator("svg").boundingBox())!;
    await page.mouse.move(box.x + 30, box.y + 60);
    await page.mouse.down({ button: "right" });
    await page.mouse.move(box.x + 70, box.y + 40);
    await page.mouse.up({ button: "right" });
    const [width, level] = (await now())!.split("/").map(Number) as [number, number];
    expect(width).toBeGreaterThan(2500);
    expect(level).toBeLessThan(480);
    await page.keyboard.press("4");
    expect(await now()).toBe("2500/480");
  });

  test("zooms a slice about the pointer, and shows all again on a double click", async () => {
    const svg = slice("Coronal").locator("svg");
    const mm = await mmPerPixel("Coronal");
    const box = (await svg.boundingBox())!;
    await page.mouse.move(box.x + 0.4 * box.width, box.y + 0.4 * box.height);
    const hu = slice("Coronal").locator(".slice-hu");
    const under = await hu.textContent();
    await page.keyboard.down("Shift");
    for (let i = 0; i < 3; ++i) await page.mouse.wheel(0, -100);
    await page.keyboard.up("Shift");
    await until("it is larger", async () => (await mmPerPixel("Coronal")) < mm / 1.9);
    expect(await hu.textContent()).toBe(under);
    await svg.dblclick({ position: { x: 0.3 * box.width, y: 0.3 * box.height } });
    expect(await mmPerPixel("Coronal")).toBeCloseTo(mm, 6);
  });

  test("measures a length and an angle, by pointer and by keys, and Escape clears", async () => {
    const box = (await slice("Transaxial").locator("svg").boundingBox())!;
    const mm = await mmPerPixel("Transaxial");
    await page.getByRole("button", { name: "Length" }).click();
    await page.mouse.move(box.x + 40, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + 90, box.y + 40);
    await page.mouse.up();
    const text = page.locator(".measure-text");
    expect(Number.parseFloat((await text.textContent())!)).toBeCloseTo(50 * mm, 0);
    await page.getByRole("button", { name: "Angle" }).click();
    for (const [x, y] of [
      [140, 60],
      [100, 60],
      [100, 100],
    ] as const)
      await page.mouse.click(box.x + x, box.y + y);
    expect(await text.last().textContent()).toBe("90.0°");
    await keepPicture(page, "plan_measure");
    await page.getByRole("button", { name: "Length" }).click();
    await slice("Sagittal").getByRole("group").focus();
    await page.keyboard.press("Enter");
    for (let i = 0; i < 5; ++i) await page.keyboard.press("ArrowUp");
    await page.keyboard.press("Enter");
    // The crosshair went up: what was measured in the transaxial slice stays with that slice.
    expect(await slice("Sagittal").locator(".measure-text").count()).toBe(1);
    expect(await text.count()).toBe(1);
    await page.keyboard.press("Escape");
    expect(await text.count()).toBe(0);
  });
});

describe("more paths", () => {
  test("are mirrored, deleted, and brought back by undo", async () => {
    await page.getByRole("button", { name: "Mirror" }).click();
    await page.getByRole("radio", { name: "right, wide" }).and(page.locator(":checked")).waitFor();
    await until("it is saved", async () => (await pathAtServer("right, wide")) !== undefined);
    await page.locator(kSaved).waitFor();
    await page.getByRole("button", { name: "Delete path" }).click();
    await until("it is gone", async () => (await pathAtServer("right, wide")) === undefined);
    await page.locator(kSaved).waitFor();
    await page.locator("main").focus();
    await page.keyboard.press("Control+z");
    await until("it is back", async () => (await pathAtServer("right, wide")) !== undefined);
    await page.locator(kSaved).waitFor();
  });

  test("where there is no bone are not saved, which is said with the reason; leaving asks", async () => {
    await page.route("**/api/v1/cases/*/paths", (route) =>
      route.fulfill({
        status: 422,
        contentType: "application/problem+json",
        body: JSON.stringify({ title: "No", status: 422, detail: "path: there is no bone along it" }),
      }),
    );
    await page.getByRole("button", { name: "New path" }).click();
    await page.locator('[data-save="failed"]').waitFor();
    expect(await page.getByRole("alert").textContent()).toContain(
      "Not saved: Path: there is no bone along it",
    );
    const asked = new Promise<string>((done) => {
      page.once("dialog", (dialog) => {
        done(dialog.type());
        void dialog.dismiss();
      });
    });
    await Promise.race([page.reload({ timeout: 5000 }).catch(() => {}), asked]);
    expect(await asked).toBe("beforeunload");
    await page.unroute("**/api/v1/cases/*/paths");
    await page.getByRole("button", { name: "Try now" }).click();
    await page.locator(kSaved).waitFor();
    // The browser logs the answer that the test made up.
    expect(errors.splice(0).every((error) => /422/.test(error))).toBe(true);
  });

  test("are drilled as they were planned, and stay so for what was drilled when they are changed", async () => {
    await page.getByRole("radio", { name: "left, wide" }).check();
    const drilled = await pathAtServer("left, wide");
    await page.getByText("Drill this path", { exact: true }).click();
    await page.locator('[data-agreement="agrees"]').waitFor();
    expect(page.url()).toContain(`/drill/${drilled.id}`);
    await page.goBack();
    const entry = handle(slice("Coronal"), "Entry");
    await entry.focus();
    await page.keyboard.press("ArrowLeft");
    await page.locator('[data-save="waiting"]').waitFor();
    await page.locator(kSaved).waitFor();
    const now = await pathAtServer("left, wide");
    expect(now.id).not.toBe(drilled.id);
    await page.waitForURL(new RegExp(`/path/${now.id}`));
    // A link to what it was leads to what it is.
    await page.goto(`${served.address}/#/`);
    await page.locator(".case-card").first().waitFor();
    await page.goto(`${served.address}/#/case/${case_id}/path/${drilled.id}`);
    await page.getByRole("radio", { name: "left, wide" }).and(page.locator(":checked")).waitFor();
  });
});
