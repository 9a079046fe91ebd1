// The face of the bone where the cut-away plane opens it, coloured by the CT, without what the bit has removed.
import {
  ClampToEdgeWrapping,
  Data3DTexture,
  DataTexture,
  DoubleSide,
  LinearFilter,
  Matrix4,
  Mesh,
  NearestFilter,
  NotEqualStencilFunc,
  PlaneGeometry,
  Quaternion,
  RedFormat,
  RedIntegerFormat,
  ReplaceStencilOp,
  ShaderMaterial,
  UnsignedByteType,
  UnsignedIntType,
  Vector3,
  Vector4,
} from "three";
import type { Lattice, VolumeBody } from "../contract/bodies";
import { type BoneUniforms, kClipping, kLighting } from "./shading";

const kVertex = /* glsl */ `
  out vec3 vWorld;
  out vec3 vView;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    vWorld = world.xyz;
    vView = (viewMatrix * world).xyz;
    gl_Position = projectionMatrix * viewMatrix * world;
  }
`;

const kFragment = /* glsl */ `
  precision highp float;
  precision highp sampler3D;
  precision highp usampler2D;
  in vec3 vWorld;
  in vec3 vView;
  uniform mat4 uToTexture;
  uniform sampler3D uCt;
  uniform vec2 uCtRange;
  uniform usampler2D uAlive;
  uniform vec4 uLattice;  // spacing, rings, discs, first disc
  uniform vec3 uNormalView;
  ${kClipping}
  ${kLighting}
  bool isRemoved(vec3 p) {
    float h = uLattice.x;
    int disc = int(round(p.z / h)) - int(uLattice.w);
    int ring = int(round(length(p.xy) / h));
    int rings = int(uLattice.y);
    if (ring >= rings || disc < 0 || disc >= int(uLattice.z)) return false;
    int index = disc * (3 * rings * (rings - 1) + 1);
    if (ring > 0) {
      int slots = 6 * ring;
      int slot = int(round(atan(p.y, p.x) / 6.283185307 * float(slots)));
      index += 3 * ring * (ring - 1) + 1 + ((slot % slots) + slots) % slots;
    }
    int word = index >> 5;
    uint bits = texelFetch(uAlive, ivec2(word & 1023, word >> 10), 0).r;
    return ((bits >> uint(index & 31)) & 1u) == 0u;
  }
  void main() {
    if (uLattice.x > 0.0 && isRemoved((uToPath * vec4(vWorld, 1.0)).xyz)) discard;
    vec3 at = (uToTexture * vec4(vWorld, 1.0)).xyz;
    float hu = mix(uCtRange.x, uCtRange.y, texture(uCt, at).r);
    float density = 47.0 + 1.122 * hu;
    vec3 albedo = boneColour(density, 1.0) * mix(0.62, 1.1, smoothstep(-50.0, 1300.0, hu));
    gl_FragColor = vec4(lightBone(normalize(uNormalView), normalize(-vView), albedo, 0.0), 1.0);
    #include <colorspace_fragment>
  }
`;

const kWordsAcross = 1024;
/** The CT is drawn in 256 steps over this range; a step is below the noise. */
const kCtRange: [number, number] = [-250, 1650];

export class SectionCap extends Mesh<PlaneGeometry, ShaderMaterial> {
  private alive: { words: Uint32Array<ArrayBuffer>; texture: DataTexture } | null = null;
  private readonly ct: Data3DTexture;

  /** `centre`: what the scene's origin is in the patient frame. */
  constructor(volume: VolumeBody, centre: [number, number, number], uniforms: BoneUniforms) {
    const ct = ctTexture(volume);
    const material = new ShaderMaterial({
      vertexShader: kVertex,
      fragmentShader: kFragment,
      side: DoubleSide,
      uniforms: {
        ...uniforms,
        uCt: { value: ct },
        uCtRange: { value: kCtRange },
        uToTexture: { value: toTexture(volume, centre) },
        uAlive: { value: emptyBits() },
        uLattice: { value: new Vector4(0, 0, 0, 0) },
        uNormalView: { value: new Vector3() },
      },
      stencilWrite: true,
      stencilRef: 0,
      stencilFunc: NotEqualStencilFunc,
      stencilFail: ReplaceStencilOp,
      stencilZFail: ReplaceStencilOp,
      stencilZPass: ReplaceStencilOp,
    });
    super(new PlaneGeometry(600, 600), material);
    this.ct = ct;
    this.renderOrder = 3;
    this.visible = false;
    this.frustumCulled = false;
    const normal = uniforms.uCutNormal.value;
    this.onBeforeRender = (_renderer, _scene, camera) => {
      (material.uniforms.uNormalView!.value as Vector3)
        .copy(normal)
        .transformDirection(camera.matrixWorldInverse);
    };
  }

  /** Lies in the plane through `point` with this unit normal. */
  place(point: Vector3, normal: Vector3): void {
    this.position.copy(point);
    this.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), normal));
  }

  /** Bits as PointVolumeBody.alive; points that were never bone count as removed. */
  setAlive(lattice: Lattice, alive: Uint32Array): void {
    const rows = Math.ceil(alive.length / kWordsAcross);
    if (this.alive?.words.length !== rows * kWordsAcross) {
      this.alive?.texture.dispose();
      const words = new Uint32Array(rows * kWordsAcross);
      const texture = new DataTexture(words, kWordsAcross, rows, RedIntegerFormat, UnsignedIntType);
      texture.internalFormat = "R32UI";
      texture.minFilter = NearestFilter;
      texture.magFilter = NearestFilter;
      this.alive = { words, texture };
    }
    this.alive.words.set(alive);
    this.alive.texture.needsUpdate = true;
    this.material.uniforms.uAlive!.value = this.alive.texture;
    const { spacing_mm, rings, discs, first_disc } = lattice;
    (this.material.uniforms.uLattice!.value as Vector4).set(spacing_mm, rings, discs, first_disc);
  }

  override dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    this.ct.dispose();
    this.alive?.texture.dispose();
  }
}

function emptyBits(): DataTexture {
  const texture = new DataTexture(new Uint32Array(1), 1, 1, RedIntegerFormat, UnsignedIntType);
  texture.internalFormat = "R32UI";
  texture.needsUpdate = true;
  return texture;
}

function ctTexture(volume: VolumeBody): Data3DTexture {
  const [low, high] = kCtRange;
  const gain = 255 / (high - low);
  const grey = new Uint8Array(volume.hu.length);
  for (let i = 0; i < grey.length; ++i) grey[i] = Math.max(0, Math.min(255, (volume.hu[i]! - low) * gain));
  const texture = new Data3DTexture(grey, volume.dims[0], volume.dims[1], volume.dims[2]);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.minFilter = LinearFilter;
  texture.magFilter = LinearFilter;
  texture.wrapS = ClampToEdgeWrapping;
  texture.wrapT = ClampToEdgeWrapping;
  texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** Scene coordinates to texture coordinates: voxel centres lie half a texel in. */
function toTexture(volume: VolumeBody, centre: [number, number, number]): Matrix4 {
  const columns = volume.axes.map((axis, a) => new Vector3(...axis).multiplyScalar(volume.spacing[a]!));
  const origin = new Vector3(...volume.origin).sub(new Vector3(...centre));
  const voxel_to_scene = new Matrix4().makeBasis(columns[0]!, columns[1]!, columns[2]!).setPosition(origin);
  const [ni, nj, nk] = volume.dims;
  const texel = new Matrix4().makeScale(1 / ni, 1 / nj, 1 / nk);
  texel.multiply(new Matrix4().makeTranslation(0.5, 0.5, 0.5));
  return texel.multiply(voxel_to_scene.invert());
}
