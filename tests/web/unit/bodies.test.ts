import { decodeMesh, decodePointVolume, decodeVolume } from "@web/contract/bodies";
import { nearestIndex } from "@web/scene/splat_cloud";
import { describe, expect, test } from "vitest";
import { goldenBytes } from "./golden";

describe("bodies", () => {
  test("the golden mesh is read", () => {
    const mesh = decodeMesh(goldenBytes("mesh.hex"));
    expect(mesh.origin).toEqual([11, 21, 30]);
    expect([...mesh.positions]).toEqual([-1, -1, 0, 0, -1, 0, -1, 0, 0.5]);
    expect([...mesh.normals]).toEqual([0, 0, 1, 0, 0, 1, 0, 0, 1]);
    expect([...mesh.triangles]).toEqual([0, 1, 2]);
  });

  test("the golden volume is read", () => {
    const volume = decodeVolume(goldenBytes("volume.hex"));
    expect(volume.dims).toEqual([2, 1, 2]);
    expect(volume.spacing).toEqual([0.5, 1, 2]);
    expect(volume.origin).toEqual([-1, 2, 3]);
    expect(volume.axes).toEqual([
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ]);
    expect([...volume.hu]).toEqual([-1024, 0, 300, 3071]);
  });

  test("the golden point volume is read", () => {
    const body = decodePointVolume(goldenBytes("point_volume.hex"));
    expect(body.lattice).toEqual({ spacing_mm: 0.5, rings: 2, discs: 1, first_disc: -1 });
    const alive = [...Array(7).keys()].filter((i) => (body.alive[i >> 5]! >> (i & 31)) & 1);
    expect(alive).toEqual([0, 1, 6]);
    expect([...body.density_mg_cm3]).toEqual([0x100, 0x101, 0x102, 0x103, 0x104, 0x105, 0x106]);
  });

  test("a body cut at any byte, or with one too many, is refused", () => {
    const bodies = [
      ["mesh.hex", decodeMesh],
      ["volume.hex", decodeVolume],
      ["point_volume.hex", decodePointVolume],
    ] as const;
    for (const [name, decode] of bodies) {
      const whole = goldenBytes(name);
      for (let length = 0; length < whole.length; ++length) {
        expect(() => decode(whole.subarray(0, length))).toThrow(/at byte/);
      }
      expect(() => decode(Uint8Array.from([...whole, 0]))).toThrow(/left over/);
    }
  });

  test("a body of another kind or version is refused", () => {
    expect(() => decodeMesh(goldenBytes("volume.hex"))).toThrow(/not a mesh/);
    const newer = goldenBytes("mesh.hex").slice();
    newer[4] = 2;
    expect(() => decodeMesh(newer)).toThrow(/version 2/);
  });

  test("a point's place gives its index back, for every point of a lattice", () => {
    const lattice = { spacing_mm: 0.1, rings: 12, discs: 5, first_disc: -2 };
    let index = 0;
    for (let disc = 0; disc < lattice.discs; ++disc) {
      for (let ring = 0; ring < lattice.rings; ++ring) {
        for (let slot = 0; slot < Math.max(1, 6 * ring); ++slot, ++index) {
          const angle = (2 * Math.PI * slot) / Math.max(1, 6 * ring);
          const x = Math.fround(ring * 0.1 * Math.cos(angle));
          const y = Math.fround(ring * 0.1 * Math.sin(angle));
          expect(nearestIndex(lattice, x, y, Math.fround((disc - 2) * 0.1))).toBe(index);
        }
      }
    }
    expect(index).toBe(5 * (3 * 12 * 11 + 1));
  });
});
