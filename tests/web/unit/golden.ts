// Reads the golden bytes of server/contract: pairs of hex digits, blanks ignored, # begins a comment.
import { readFileSync } from "node:fs";
import { resolve } from "node:path";

const folder = resolve(import.meta.dirname, "../../../server/contract/golden");

export function goldenBytes(name: string): Uint8Array {
  const text = readFileSync(resolve(folder, name), "utf8").replace(/#.*$/gm, "");
  const pairs = text.match(/[0-9a-fA-F]{2}/g) ?? [];
  return Uint8Array.from(pairs, (pair) => Number.parseInt(pair, 16));
}
