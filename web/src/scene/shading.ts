// One way to light bone, shared by the mesh, the splats that replace it along the path, and the section through it,
// so that no seam shows where one takes over from another.
import { Color, Matrix4, Vector2, Vector3 } from "three";

export const kLighting = /* glsl */ `
  // n, v: unit, view space. Lights sit with the viewer, as a headlamp and a fill would.
  vec3 lightBone(vec3 n, vec3 v, vec3 albedo, float gloss) {
    vec3 key = normalize(vec3(-0.45, 0.65, 0.75));
    vec3 fill = normalize(vec3(0.8, -0.15, 0.45));
    float wrap = 0.18;
    float k = max(0.0, (dot(n, key) + wrap) / (1.0 + wrap));
    float f = max(0.0, dot(n, fill));
    float sky = 0.5 + 0.5 * n.y;
    vec3 light = vec3(1.0, 0.965, 0.91) * (0.86 * k) + vec3(0.62, 0.74, 0.9) * (0.2 * f)
               + mix(vec3(0.075, 0.06, 0.055), vec3(0.17, 0.185, 0.21), sky);
    float h = max(0.0, dot(n, normalize(key + v)));
    float rim = pow(1.0 - max(0.0, dot(n, v)), 3.0);
    return albedo * light + vec3(1.0, 0.97, 0.92) * (gloss * pow(h, 38.0)) + vec3(0.10, 0.14, 0.17) * rim;
  }
  // Cortex is ivory, marrow-filled bone redder and darker; cut faces show which is which.
  vec3 boneColour(float density_mg_cm3, float cut) {
    vec3 surface = vec3(0.70, 0.585, 0.43);
    float cortex = smoothstep(260.0, 900.0, density_mg_cm3);
    vec3 inside = mix(vec3(0.47, 0.185, 0.115), vec3(0.78, 0.69, 0.55), cortex);
    return mix(surface, inside, cut);
  }
`;

export const kSurfaceDensity = 1000;

/** What every bone shader is told: the modelled cylinder, the cut-away plane, how solid bone looks. */
export interface BoneUniforms {
  /** World to path frame. */
  uToPath: { value: Matrix4 };
  /** Radius, low z and high z of the modelled cylinder, path frame mm; radius 0 when there is none. */
  uCylinder: { value: Vector3 };
  /** A point on the cut-away plane and its normal, towards the viewer; a zero normal when nothing is cut away. */
  uCutPoint: { value: Vector3 };
  uCutNormal: { value: Vector3 };
  uOpacity: { value: number };
  uViewport: { value: Vector2 };
}

export function makeBoneUniforms(): BoneUniforms {
  return {
    uToPath: { value: new Matrix4() },
    uCylinder: { value: new Vector3(0, 0, 0) },
    uCutPoint: { value: new Vector3() },
    uCutNormal: { value: new Vector3() },
    uOpacity: { value: 1 },
    uViewport: { value: new Vector2(1, 1) },
  };
}

export const kClipping = /* glsl */ `
  uniform mat4 uToPath;
  uniform vec3 uCylinder;
  uniform vec3 uCutPoint;
  uniform vec3 uCutNormal;
  bool isCutAway(vec3 world) { return dot(world - uCutPoint, uCutNormal) > 0.0; }
  bool isInCylinder(vec3 world) {
    vec3 p = (uToPath * vec4(world, 1.0)).xyz;
    return dot(p.xy, p.xy) < uCylinder.x * uCylinder.x && p.z > uCylinder.y && p.z < uCylinder.z;
  }
`;

export const kAccent = {
  path: new Color(0x35c3d6),
  entry: new Color(0x5fe08a),
  target: new Color(0xf2a541),
  transaxial: new Color(0xe5675f),
  coronal: new Color(0x6cc46a),
  sagittal: new Color(0xe3c34c),
};
