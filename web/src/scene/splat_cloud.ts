// Exposed points as oriented discs, shaded and with their true depth, so that together they close into a surface.
// After: M. Botsch et al., "High-Quality Surface Splatting on Today's GPUs", Point-Based Graphics 2005 (the
// ray-plane intersection per fragment; blending is left out).
import {
  BufferGeometry,
  DynamicDrawUsage,
  InterleavedBuffer,
  InterleavedBufferAttribute,
  Matrix4,
  Points,
  ShaderMaterial,
  Sphere,
  Vector3,
} from "three";
import type { Lattice } from "../contract/bodies";
import { kSplatFloats } from "../worker/core_api";
import { type BoneUniforms, kClipping, kLighting, kSurfaceDensity } from "./shading";
import { Slots } from "./slots";
import type { SurfacePatch } from "./surface_patch";

/** Position, normal, kind, density. */
const kFloats = 8;
/**
 * A ball of 0.88 h about each exposed point leaves no gap (core/splats/splats.h); a disc is flat, and neighbours lie up to
 * h before or behind one another, so seen along the surface a wider one is needed.
 */
const kRadiusPerSpacing = 1.5;
/** Walls of the cut stand in rings, closer together; smaller discs stick out less over the hole's rim. */
const kWallShare = 0.8;
/** A point nearer to the mesh than this, in spacings, is drawn on it. */
const kSnapPerSpacing = 2;

const kVertex = /* glsl */ `
  in vec4 shade;  // normal, kind
  in float density;
  uniform float uRadius;
  uniform vec2 uViewport;
  flat out vec3 vCentre;
  flat out vec3 vNormal;
  flat out vec2 vLook;
  flat out float vRadius;
  void main() {
    vRadius = uRadius * mix(1.0, ${kWallShare}, shade.w);
    vec4 view = modelViewMatrix * vec4(position, 1.0);
    vCentre = view.xyz;
    vNormal = normalize(normalMatrix * shade.xyz);
    vLook = vec2(shade.w, density);
    gl_Position = projectionMatrix * view;
    gl_PointSize = 2.2 * vRadius * projectionMatrix[1][1] * 0.5 * uViewport.y / max(0.1, -view.z) + 1.5;
  }
`;

const kFragment = /* glsl */ `
  precision highp float;
  flat in vec3 vCentre;
  flat in vec3 vNormal;
  flat in vec2 vLook;
  flat in float vRadius;
  uniform vec2 uViewport;
  uniform mat4 uViewToWorld;
  uniform mat4 projectionMatrix;
  ${kClipping}
  ${kLighting}
  void main() {
    // Where the ray through this fragment meets the disc's plane, in view space.
    vec2 ndc = 2.0 * gl_FragCoord.xy / uViewport - 1.0;
    vec3 ray = vec3(ndc.x / projectionMatrix[0][0], ndc.y / projectionMatrix[1][1], -1.0);
    float slope = dot(ray, vNormal);
    if (abs(slope) < 1e-4) discard;
    vec3 p = ray * (dot(vCentre, vNormal) / slope);
    vec3 d = p - vCentre;
    if (dot(d, d) > vRadius * vRadius) discard;
    if (isCutAway((uViewToWorld * vec4(p, 1.0)).xyz)) discard;
    vec4 clip = projectionMatrix * vec4(p, 1.0);
    gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
    vec3 v = normalize(-p);
    vec3 n = dot(vNormal, v) < 0.0 ? -vNormal : vNormal;
    float cut = vLook.x;
    gl_FragColor = vec4(lightBone(n, v, boneColour(vLook.y, cut), mix(0.10, 0.05, cut)), 1.0);
    #include <colorspace_fragment>
  }
`;

/** Room for three times the cylinder's own surface: outer bone, hole wall and strays. */
function capacityOf(lattice: Lattice): number {
  const radius = (lattice.rings - 1) * lattice.spacing_mm;
  const length = lattice.discs * lattice.spacing_mm;
  const area = 2 * Math.PI * radius * (radius + length);
  return Math.min(4_000_000, Math.ceil((3 * area) / lattice.spacing_mm ** 2) + 4096);
}

export class SplatCloud extends Points<BufferGeometry, ShaderMaterial> {
  private readonly data: Float32Array;
  private readonly buffer: InterleavedBuffer;
  private readonly slots: Slots;
  private readonly view_to_world = new Matrix4();
  /** Exposed points that found no room. */
  dropped = 0;

  constructor(
    private readonly lattice: Lattice,
    private readonly density_of: (index: number) => number,
    /** The outer surface, path frame; null where the points' own positions and normals must do. */
    private readonly surface: SurfacePatch | null,
    uniforms: BoneUniforms,
  ) {
    const capacity = capacityOf(lattice);
    const data = new Float32Array(capacity * kFloats);
    const buffer = new InterleavedBuffer(data, kFloats);
    buffer.setUsage(DynamicDrawUsage);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new InterleavedBufferAttribute(buffer, 3, 0));
    geometry.setAttribute("shade", new InterleavedBufferAttribute(buffer, 4, 3));
    geometry.setAttribute("density", new InterleavedBufferAttribute(buffer, 1, 7));
    geometry.boundingSphere = new Sphere(new Vector3(), 1000);
    const material = new ShaderMaterial({
      vertexShader: kVertex,
      fragmentShader: kFragment,
      uniforms: {
        ...uniforms,
        uRadius: { value: kRadiusPerSpacing * lattice.spacing_mm },
        uViewToWorld: { value: new Matrix4() },
      },
    });
    super(geometry, material);
    this.data = data;
    this.buffer = buffer;
    this.slots = new Slots(capacity);
    this.frustumCulled = false;
    this.renderOrder = 1;
    material.uniforms.uViewToWorld!.value = this.view_to_world;
    this.onBeforeRender = (_renderer, _scene, camera) => this.view_to_world.copy(camera.matrixWorld);
    geometry.setDrawRange(0, 0);
  }

  get exposed(): number {
    return this.slots.size;
  }

  /** Rows of kSplatFloats with the lattice index of each, and the indices no longer to be drawn. */
  change(rows: Float32Array, indices: Uint32Array, hidden: Uint32Array): void {
    for (const index of hidden) this.hide(index);
    for (let i = 0; i < indices.length; ++i) this.put(indices[i]!, rows, i * kSplatFloats);
    this.upload();
  }

  /** Draws exactly these; for a replay, which gives all that is exposed at a moment. */
  replace(rows: Float32Array): void {
    this.slots.clear();
    const count = Math.floor(rows.length / kSplatFloats);
    for (let i = 0; i < count; ++i) {
      const at = i * kSplatFloats;
      this.put(nearestIndex(this.lattice, rows[at]!, rows[at + 1]!, rows[at + 2]!), rows, at);
    }
    this.upload();
  }

  override dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
  }

  private put(index: number, rows: Float32Array, at: number): void {
    const slot = this.slots.take(index);
    if (slot < 0) {
      ++this.dropped;
      return;
    }
    const to = slot * kFloats;
    for (let f = 0; f < kSplatFloats; ++f) this.data[to + f] = rows[at + f]!;
    const is_outer = rows[at + 6] === 0;
    this.data[to + 7] = is_outer ? kSurfaceDensity : this.density_of(index);
    if (is_outer) this.layOnSurface(to);
  }

  /** The lattice's points stand in terraces beneath the surface; drawn on it, they close as it does. */
  private layOnSurface(to: number): void {
    const near = this.surface?.at(this.data[to]!, this.data[to + 1]!, this.data[to + 2]!);
    if (!near || Math.abs(near.distance_mm) > kSnapPerSpacing * this.lattice.spacing_mm) return;
    for (let a = 0; a < 3; ++a) {
      this.data[to + a]! -= near.distance_mm * near.normal[a]!;
      this.data[to + 3 + a] = near.normal[a]!;
    }
  }

  private hide(index: number): void {
    const move = this.slots.free(index);
    if (move) this.data.copyWithin(move.to * kFloats, move.from * kFloats, (move.from + 1) * kFloats);
  }

  private upload(): void {
    for (const [start, end] of this.slots.takeDirty()) {
      this.buffer.addUpdateRange(start * kFloats, (end - start) * kFloats);
      this.buffer.needsUpdate = true;
    }
    this.geometry.setDrawRange(0, this.slots.size);
  }
}

/** The lattice point at these path-frame coordinates; see core/point_volume/lattice.h. */
export function nearestIndex(lattice: Lattice, x: number, y: number, z: number): number {
  const disc = Math.round(z / lattice.spacing_mm) - lattice.first_disc;
  const ring = Math.round(Math.hypot(x, y) / lattice.spacing_mm);
  const per_disc = 3 * lattice.rings * (lattice.rings - 1) + 1;
  if (ring === 0) return disc * per_disc;
  const slots = 6 * ring;
  const turn = Math.atan2(y, x) / (2 * Math.PI);
  const slot = ((Math.round(turn * slots) % slots) + slots) % slots;
  return disc * per_disc + 3 * ring * (ring - 1) + 1 + slot;
}
