// The real program, serving the built pages over a folder with the demonstration case.
import { type ChildProcess, execFileSync, spawn } from "node:child_process";
import { cpSync, existsSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";

export const top = resolve(import.meta.dirname, "../../..");
export const program = resolve(process.env.SPINALTAP_PROGRAM ?? `${top}/build/release/bin/spinaltap`);
export const pages = resolve(process.env.SPINALTAP_WEB_DIR ?? `${top}/build/web/dist`);
/** Kept between runs: making the case takes half a minute. Recordings pile up in it, which the tests allow for. */
const data = resolve(process.env.SPINALTAP_E2E_DATA ?? `${top}/build/web/e2e-data`);

export interface Served {
  address: string;
  stop: () => Promise<void>;
}

export async function serve(): Promise<Served> {
  makeCase();
  return start(data);
}

/** The same case in a folder of its own, to be changed at will; gone with the server. */
export async function serveCopy(): Promise<Served> {
  makeCase();
  const folder = mkdtempSync(join(tmpdir(), "spinaltap-copy-"));
  cpSync(data, folder, { recursive: true });
  const { address, stop } = await start(folder);
  return { address, stop: () => stop().finally(() => rmSync(folder, { recursive: true })) };
}

function makeCase(): void {
  checkBuilt();
  mkdirSync(data, { recursive: true });
  execFileSync("bash", [`${top}/docker/demo_case.sh`, program, data], {
    stdio: ["ignore", "inherit", "inherit"],
  });
}

/** A server over an empty folder. */
export function serveNothing(folder: string): Promise<Served> {
  return start(folder);
}

function checkBuilt(): void {
  for (const [what, path] of Object.entries({ program, pages: `${pages}/index.html` })) {
    if (!existsSync(path))
      throw new Error(`the ${what} to test are not built; ./run.sh --build-only builds them`);
  }
}

async function start(folder: string): Promise<Served> {
  checkBuilt();
  const child = spawn(program, ["serve", "--data", folder, "--port", "0", "--web", pages], {
    stdio: ["ignore", "pipe", "inherit"],
  });
  const address = await firstAddress(child);
  return { address, stop: () => stopped(child) };
}

function firstAddress(child: ChildProcess): Promise<string> {
  return new Promise((found, failed) => {
    let said = "";
    child.stdout!.on("data", (chunk: Buffer) => {
      said += chunk.toString();
      const address = said.match(/https?:\/\/[\w.:[\]-]+/);
      if (address) found(address[0]);
    });
    child.once("exit", (code) =>
      failed(new Error(`spinaltap serve ended with ${code} before it said its address`)),
    );
  });
}

function stopped(child: ChildProcess): Promise<void> {
  return new Promise((done) => {
    child.removeAllListeners("exit");
    child.once("exit", () => done());
    child.kill("SIGTERM");
  });
}
