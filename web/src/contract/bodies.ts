// The large bodies: a mesh (STM1), a CT volume (STV1), a point volume (STP1). Layout: server/contract/haptics.md.
import { ByteReader } from "./bytes";

export type Vec3 = [number, number, number];

/** Positions are mm relative to `origin`, in the patient frame (LPS). */
export interface MeshBody {
  origin: Vec3;
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  triangles: Uint32Array<ArrayBuffer>;
}

/** Voxel (i, j, k) lies at origin + i*spacing[0]*axes[0] + j*spacing[1]*axes[1] + k*spacing[2]*axes[2]. */
export interface VolumeBody {
  dims: Vec3;
  spacing: Vec3;
  origin: Vec3;
  /** The columns of the direction matrix. */
  axes: [Vec3, Vec3, Vec3];
  /** i fastest, then j, then k. */
  hu: Int16Array<ArrayBuffer>;
}

export interface Lattice {
  spacing_mm: number;
  rings: number;
  discs: number;
  first_disc: number;
}

export interface PointVolumeBody {
  lattice: Lattice;
  /** Bit (index & 31) of word (index >> 5): the 64-bit words of the wire, halved. */
  alive: Uint32Array<ArrayBuffer>;
  density_mg_cm3: Uint16Array<ArrayBuffer>;
}

function open(bytes: Uint8Array, what: string, magic: string): ByteReader {
  const reader = new ByteReader(bytes, what);
  const found = String.fromCharCode(reader.u8(), reader.u8(), reader.u8(), reader.u8());
  if (found !== magic) throw reader.error(`not a ${what}`);
  const version = reader.u32();
  if (version !== 1) throw reader.error(`version ${version} of the ${what} is not known to this page`);
  return reader;
}

/** @throws ContractError, naming the offset. */
export function decodeMesh(bytes: Uint8Array): MeshBody {
  const reader = open(bytes, "mesh", "STM1");
  const vertices = reader.u32();
  const triangle_count = reader.u32();
  const origin = reader.vec3();
  const positions = reader.f32Array(3 * vertices);
  const normals = reader.f32Array(3 * vertices);
  const triangles = reader.u32Array(3 * triangle_count);
  if (triangles.some((vertex) => vertex >= vertices)) throw reader.error("a triangle names no vertex");
  reader.end();
  return { origin, positions, normals, triangles };
}

/** @throws ContractError, naming the offset. */
export function decodeVolume(bytes: Uint8Array): VolumeBody {
  const reader = open(bytes, "volume", "STV1");
  const dims: Vec3 = [reader.i32(), reader.i32(), reader.i32()];
  const spacing = reader.vec3();
  const origin = reader.vec3();
  const axes: [Vec3, Vec3, Vec3] = [reader.vec3(), reader.vec3(), reader.vec3()];
  if (dims.some((n) => n <= 0) || spacing.some((s) => !(s > 0))) throw reader.error("an empty grid");
  const hu = reader.i16Array(dims[0] * dims[1] * dims[2]);
  reader.end();
  return { dims, spacing, origin, axes, hu };
}

/** 3n(n-1) + 1: a centre point and rings k = 1 .. n-1 of 6k points. */
export function pointsPerDisc(lattice: Lattice): number {
  return 3 * lattice.rings * (lattice.rings - 1) + 1;
}

/** What one point stands for: pi/3 * spacing^3, as core/point_volume/lattice.h. */
export function pointVolume_mm3(lattice: Lattice): number {
  return (Math.PI / 3) * lattice.spacing_mm ** 3;
}

/** @throws ContractError, naming the offset. */
export function decodePointVolume(bytes: Uint8Array): PointVolumeBody {
  const reader = open(bytes, "point volume", "STP1");
  const lattice = {
    spacing_mm: reader.f64(),
    rings: reader.i32(),
    discs: reader.i32(),
    first_disc: reader.i32(),
  };
  const words = Number(reader.u64());
  const points = pointsPerDisc(lattice) * lattice.discs;
  if (words !== Math.ceil(points / 64)) throw reader.error(`${words} alive words for ${points} points`);
  const alive = reader.u32Array(2 * words);
  const density_mg_cm3 = reader.u16Array(points);
  reader.end();
  return { lattice, alive, density_mg_cm3 };
}
