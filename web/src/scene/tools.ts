// What is drawn beside the bone: the bit, the planned hole, the guide planes of the slices.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Group,
  LatheGeometry,
  LineBasicMaterial,
  LineLoop,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  type Object3D,
  Quaternion,
  SphereGeometry,
  TorusGeometry,
  Vector2,
  Vector3,
} from "three";
import type { Vec3 } from "../contract/bodies";
import type { BitInfo } from "../contract/rest";
import type { Box, Plane } from "../geometry/slice";
import { kViews } from "../geometry/slice";
import { kAccent } from "./shading";

/** A bit with its chuck. Its origin is the cone's apex; it points along the group's +z. */
export class BitModel extends Group {
  private readonly metal: MeshStandardMaterial[];
  private readonly spin = new Group();
  /** What hides the view down the bit. */
  private readonly behind: Object3D[];
  /** Fat and unseen: what a pointer grabs. */
  readonly grip: Mesh;

  constructor(bit: BitInfo) {
    super();
    const radius = bit.diameter_mm / 2;
    const steel = new MeshStandardMaterial({ color: 0xc9d2da, metalness: 0.25, roughness: 0.38 });
    const dark = new MeshStandardMaterial({ color: 0x5a6570, metalness: 0.2, roughness: 0.5 });
    this.metal = [steel, dark];
    const outline = [
      new Vector2(0, 0),
      new Vector2(radius, bit.cone_length_mm),
      new Vector2(radius, bit.length_mm),
      new Vector2(0, bit.length_mm),
    ];
    this.spin.add(upright(new Mesh(new LatheGeometry(outline, 48), steel)));
    const spiral = flutes(radius, bit);
    this.spin.add(spiral);
    const chuck = new Mesh(new CylinderGeometry(radius * 2.6, radius * 1.9, 12, 40), dark);
    chuck.position.z = -(bit.length_mm + 5);
    chuck.rotation.x = -Math.PI / 2;
    const shaft = new Mesh(new CylinderGeometry(radius * 1.5, radius * 1.5, 40, 32), steel);
    shaft.position.z = -(bit.length_mm + 30);
    shaft.rotation.x = -Math.PI / 2;
    this.grip = new Mesh(
      new CylinderGeometry(radius * 3, radius * 3, bit.length_mm + 50, 12),
      new MeshBasicMaterial({ colorWrite: false, depthWrite: false }),
    );
    this.grip.position.z = -(bit.length_mm + 50) / 2;
    this.grip.rotation.x = -Math.PI / 2;
    this.grip.renderOrder = 100;
    this.behind = [spiral, chuck, shaft];
    this.add(this.spin, chuck, shaft, this.grip);
  }

  /** Tip and axis in the parent's frame. */
  setPose(tip: Vec3, axis: Vec3): void {
    this.position.set(...tip);
    this.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...axis)));
  }
  turn(radians: number): void {
    this.spin.rotation.z += radians;
  }
  /** Only a hint of the bit itself, to look along it. */
  setGhost(ghost: boolean): void {
    for (const part of this.behind) part.visible = !ghost;
    for (const material of this.metal) {
      material.transparent = ghost;
      material.opacity = ghost ? 0.22 : 1;
      material.depthWrite = !ghost;
      material.needsUpdate = true;
    }
  }
  override dispose(): void {
    disposeTree(this);
  }
}

/** A Lathe stands along +y with its first point at the bottom; the bit's apex points to +z. */
function upright(mesh: Mesh): Mesh {
  mesh.rotation.x = -Math.PI / 2;
  return mesh;
}

/** Two dark helical lines, so that the eye sees the bit turn. */
function flutes(radius: number, bit: BitInfo): LineSegments {
  const points: number[] = [];
  const at = (along: number, phase: number): number[] => {
    const r =
      Math.min(radius, bit.cone_length_mm > 0 ? (radius * along) / bit.cone_length_mm : radius) * 1.012;
    const angle = along * 0.55 + phase;
    return [r * Math.cos(angle), r * Math.sin(angle), -along];
  };
  for (const phase of [0, Math.PI]) {
    for (let along = 0.3; along < bit.length_mm * 0.8; along += 0.25) {
      points.push(...at(along, phase), ...at(along + 0.25, phase));
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  return new LineSegments(
    geometry,
    new LineBasicMaterial({ color: 0x3a434c, transparent: true, opacity: 0.8 }),
  );
}

/** The planned hole, its axis, entry and target. Drawn in the path frame: entry at the origin, target on +z. */
export class PathModel extends Group {
  constructor(length_mm: number, diameter_mm: number, chosen: boolean, marks: boolean) {
    super();
    const colour = chosen ? kAccent.path : new Color(0x7f8b96);
    const radius = diameter_mm / 2;
    const line = new BufferGeometry().setFromPoints([new Vector3(0, 0, -18), new Vector3(0, 0, length_mm)]);
    this.add(new LineSegments(line, new LineBasicMaterial({ color: colour })));
    this.add(ghost(new LineSegments(line, new LineBasicMaterial({ color: colour })), 0.55));
    const hole = new Mesh(
      new CylinderGeometry(radius, radius, length_mm, 48, 1, true),
      new MeshBasicMaterial({ color: colour, side: DoubleSide }),
    );
    hole.rotation.x = Math.PI / 2;
    hole.position.z = length_mm / 2;
    this.add(ghost(hole, chosen && marks ? 0.2 : 0.1));
    this.add(...ring(radius, 0, chosen ? kAccent.entry : colour));
    this.add(...ring(radius, length_mm, chosen ? kAccent.target : colour));
    if (marks)
      this.add(
        ...ball(0, chosen ? kAccent.entry : colour),
        ...ball(length_mm, chosen ? kAccent.target : colour),
      );
  }
  override dispose(): void {
    disposeTree(this);
  }
}

/** Seen through bone, faintly. */
function ghost<T extends Mesh | LineSegments>(object: T, opacity: number): T {
  const material = object.material as MeshBasicMaterial;
  material.transparent = true;
  material.opacity = opacity;
  material.depthTest = false;
  material.depthWrite = false;
  object.renderOrder = 20;
  return object;
}

function ring(radius: number, z: number, colour: Color): Mesh[] {
  const make = (): Mesh => {
    const mesh = new Mesh(new TorusGeometry(radius, 0.06, 10, 64), new MeshBasicMaterial({ color: colour }));
    mesh.position.z = z;
    return mesh;
  };
  return [make(), ghost(make(), 0.6)];
}

function ball(z: number, colour: Color): Mesh[] {
  const make = (): Mesh => {
    const mesh = new Mesh(new SphereGeometry(0.4, 20, 14), new MeshBasicMaterial({ color: colour }));
    mesh.position.z = z;
    return mesh;
  };
  return [make(), ghost(make(), 0.5)];
}

/** Where the three slices lie, as coloured frames in patient axes. */
export class GuidePlanes extends Group {
  private readonly frames = new Map<Plane, Group>();

  constructor(
    private readonly box: Box,
    private readonly centre: Vec3,
  ) {
    super();
    for (const plane of ["transaxial", "coronal", "sagittal"] as const) {
      const frame = this.frame(plane);
      this.frames.set(plane, frame);
      this.add(frame);
    }
  }

  setPoint(point: Vec3): void {
    for (const [plane, frame] of this.frames) {
      const through = kViews[plane].through;
      frame.position.setComponent(through, point[through] - this.centre[through]);
    }
  }
  override dispose(): void {
    disposeTree(this);
  }

  private frame(plane: Plane): Group {
    const through = kViews[plane].through;
    const [a, b] = [0, 1, 2].filter((axis) => axis !== through) as [number, number];
    const corner = (at_a: "low" | "high", at_b: "low" | "high"): Vector3 => {
      const p = new Vector3();
      p.setComponent(a, this.box[at_a][a]! - this.centre[a]!);
      p.setComponent(b, this.box[at_b][b]! - this.centre[b]!);
      return p;
    };
    const corners = [
      corner("low", "low"),
      corner("high", "low"),
      corner("high", "high"),
      corner("low", "high"),
    ];
    const edge = new BufferGeometry().setFromPoints(corners);
    const face = new BufferGeometry().setFromPoints(corners);
    face.setIndex([0, 1, 2, 0, 2, 3]);
    const colour = kAccent[plane];
    const group = new Group();
    group.add(new LineLoop(edge, new LineBasicMaterial({ color: colour, transparent: true, opacity: 0.7 })));
    const glass = new MeshBasicMaterial({
      color: colour,
      transparent: true,
      opacity: 0.045,
      side: DoubleSide,
      depthWrite: false,
    });
    const sheet = new Mesh(face, glass);
    sheet.renderOrder = 15;
    group.add(sheet);
    return group;
  }
}

export function disposeTree(root: Group): void {
  root.traverse((object) => {
    const drawn = object as Partial<Mesh>;
    drawn.geometry?.dispose();
    const material = drawn.material;
    if (Array.isArray(material)) for (const one of material) one.dispose();
    else material?.dispose();
  });
}
