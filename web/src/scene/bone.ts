// The vertebra's mesh: solid or glass, cut open by a plane, left out where the point volume stands in for it.
import {
  AlwaysStencilFunc,
  BackSide,
  BufferAttribute,
  BufferGeometry,
  DecrementWrapStencilOp,
  DoubleSide,
  FrontSide,
  Group,
  IncrementWrapStencilOp,
  Mesh,
  ShaderMaterial,
  type Side,
} from "three";
import type { MeshBody } from "../contract/bodies";
import { type BoneUniforms, kClipping, kLighting } from "./shading";

const kVertex = /* glsl */ `
  out vec3 vNormal;
  out vec3 vView;
  out vec3 vWorld;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    vec4 view = viewMatrix * world;
    vWorld = world.xyz;
    vView = view.xyz;
    vNormal = normalMatrix * normal;
    gl_Position = projectionMatrix * view;
  }
`;

const kFragment = /* glsl */ `
  precision highp float;
  in vec3 vNormal;
  in vec3 vView;
  in vec3 vWorld;
  uniform float uOpacity;
  ${kClipping}
  ${kLighting}
  void main() {
    if (isCutAway(vWorld) || isInCylinder(vWorld)) discard;
    vec3 v = normalize(-vView);
    vec3 n = normalize(vNormal);
    bool back = dot(n, v) < 0.0;
    if (back) n = -n;
    vec3 albedo = boneColour(1000.0, 0.0) * (back ? vec3(0.55, 0.42, 0.38) : vec3(1.0));
    vec3 lit = lightBone(n, v, albedo, back ? 0.0 : 0.10);
    // Glass: faint where seen face on, denser at the edges, as in a radiograph.
    float edge = pow(1.0 - abs(dot(n, v)), 1.6);
    float alpha = mix(mix(0.06, 0.75, edge), 1.0, uOpacity);
    gl_FragColor = vec4(lit, alpha);
    #include <colorspace_fragment>
  }
`;

const kStencilFragment = /* glsl */ `
  precision highp float;
  in vec3 vWorld;
  ${kClipping}
  void main() {
    if (isCutAway(vWorld)) discard;
    gl_FragColor = vec4(0.0);
  }
`;

export class Bone extends Group {
  private readonly solid: Mesh<BufferGeometry, ShaderMaterial>;
  private readonly counters: Mesh[];

  constructor(body: MeshBody, uniforms: BoneUniforms) {
    super();
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(body.positions, 3));
    geometry.setAttribute("normal", new BufferAttribute(body.normals, 3));
    geometry.setIndex(new BufferAttribute(body.triangles, 1));
    geometry.computeBoundingSphere();
    this.solid = new Mesh(geometry, surfaceMaterial(uniforms));
    this.solid.renderOrder = 1;
    this.counters = [stencilMesh(geometry, uniforms, BackSide), stencilMesh(geometry, uniforms, FrontSide)];
    this.add(this.solid, ...this.counters);
    this.setSectioned(false);
  }

  get radius_mm(): number {
    return this.solid.geometry.boundingSphere!.radius;
  }

  setOpacity(opacity: number): void {
    const material = this.solid.material;
    material.uniforms.uOpacity!.value = opacity;
    material.transparent = opacity < 1;
    material.depthWrite = opacity >= 1;
    this.solid.renderOrder = opacity < 1 ? 10 : 1;
    material.needsUpdate = true;
  }

  /** Counts, in the stencil, how many of the mesh's walls lie before the cut-away plane: the inside is not zero. */
  setSectioned(on: boolean): void {
    for (const counter of this.counters) counter.visible = on;
  }

  override dispose(): void {
    this.solid.geometry.dispose();
    this.solid.material.dispose();
    for (const counter of this.counters) (counter.material as ShaderMaterial).dispose();
  }
}

function surfaceMaterial(uniforms: BoneUniforms): ShaderMaterial {
  return new ShaderMaterial({
    vertexShader: kVertex,
    fragmentShader: kFragment,
    uniforms: { ...uniforms },
    side: DoubleSide,
  });
}

function stencilMesh(geometry: BufferGeometry, uniforms: BoneUniforms, side: Side): Mesh {
  const operation = side === BackSide ? IncrementWrapStencilOp : DecrementWrapStencilOp;
  const material = new ShaderMaterial({
    vertexShader: kVertex,
    fragmentShader: kStencilFragment,
    uniforms: { ...uniforms },
    side,
    colorWrite: false,
    depthWrite: false,
    depthTest: false,
    stencilWrite: true,
    stencilFunc: AlwaysStencilFunc,
    stencilFail: operation,
    stencilZFail: operation,
    stencilZPass: operation,
  });
  const mesh = new Mesh(geometry, material);
  mesh.renderOrder = 2;
  return mesh;
}
