// What every room with a picture shows: the vertebra, its paths, the bit, and along the chosen path the points.
import { Group, type Matrix4, Vector3 } from "three";
import type { Lattice, PointVolumeBody, Vec3 } from "../contract/bodies";
import type { DrawnPath } from "../contract/rest";
import { screenAcross } from "../geometry/screen";
import { boundsOf } from "../geometry/slice";
import { add, directionToLocal, directionToPatient, dot, toPatient } from "../geometry/vec";
import type { CaseData } from "../state/case_data";
import type { SplatChange } from "../worker/messages";
import { acrossAxes } from "../worker/motion";
import { Bone } from "./bone";
import { SectionCap } from "./section_cap";
import { SplatCloud } from "./splat_cloud";
import { Stage } from "./stage";
import { SurfacePatch } from "./surface_patch";
import { BitModel, GuidePlanes, PathModel } from "./tools";

/** The mesh goes on this many spacings into the modelled cylinder: its outermost points count as hidden by bone beyond
 * them, so that a surface which leaves the cylinder at a grazing angle has no points of its own there. */
const kSeam = 1.5;

export class VertebraScene {
  readonly stage: Stage;
  splats: SplatCloud | null = null;
  bit: BitModel | null = null;
  private readonly bone: Bone | null;
  private readonly guides: GuidePlanes | null;
  private readonly cap: SectionCap | null;
  private readonly path_groups = new Group();
  private path: DrawnPath | null = null;
  private path_group: Group | null = null;
  private lattice: Lattice | null = null;
  private cut_away = false;
  private pose: { tip: Vec3; axis: Vec3 } = { tip: [0, 0, 0], axis: [0, 0, 1] };
  /** Radians a second that the drawn bit turns: slower than the real one, so that the eye sees it. */
  spin = 0;

  constructor(
    canvas: HTMLCanvasElement,
    private readonly data: CaseData,
  ) {
    this.stage = new Stage(canvas, data.centre);
    this.stage.world.add(this.path_groups);
    this.bone = data.mesh ? new Bone(data.mesh, this.stage.bone) : null;
    if (this.bone) this.stage.world.add(this.bone);
    this.guides = data.volume ? new GuidePlanes(boundsOf(data.volume), data.centre) : null;
    if (this.guides) this.stage.world.add(this.guides);
    this.cap = data.volume ? new SectionCap(data.volume, data.centre, this.stage.bone) : null;
    if (this.cap) this.stage.world.add(this.cap);
    this.stage.onFrame = (seconds) => this.beforeFrame(seconds);
    this.stage.lookFrom("P", this.bone);
    this.stage.orbitBy(0.62, 0.42);
  }

  dispose(): void {
    this.bone?.dispose();
    this.guides?.dispose();
    this.cap?.dispose();
    this.splats?.dispose();
    this.bit?.dispose();
    for (const group of this.path_groups.children) (group.children[0] as PathModel).dispose();
    this.stage.dispose();
  }

  /** Every path of the case, the chosen one bright, with the bit standing before its entry. `marks`: balls at the ends. */
  showPaths(paths: DrawnPath[], chosen: DrawnPath | null, marks = true): void {
    for (const group of [...this.path_groups.children]) {
      (group.children[0] as PathModel).dispose();
      this.path_groups.remove(group);
    }
    for (const path of paths) {
      const group = this.stage.pathGroup(path.frame);
      group.add(new PathModel(path.length_mm, path.bit.diameter_mm, path.id === chosen?.id, marks));
      this.path_groups.add(group);
    }
    this.choose(chosen);
    this.stage.invalidate();
  }

  private choose(path: DrawnPath | null): void {
    if (path && this.path && this.path_group && sameBit(path, this.path)) {
      this.path = path;
      this.stage.movePathGroup(this.path_group, path.frame);
      return;
    }
    this.bit?.dispose();
    if (this.path_group) this.stage.world.remove(this.path_group);
    this.bit = null;
    this.path_group = null;
    this.path = path;
    if (!path) return;
    this.path_group = this.stage.pathGroup(path.frame);
    this.bit = new BitModel(path.bit);
    this.path_group.add(this.bit);
    this.setBit([0, 0, -6], [0, 0, 1]);
  }

  /** Path frame. */
  setBit(tip: Vec3, axis: Vec3): void {
    this.pose = { tip, axis };
    this.bit?.setPose(tip, axis);
    this.stage.invalidate();
  }

  /** What the core says changed in what is exposed. */
  change(change: SplatChange): void {
    this.splats?.change(change.rows, change.indices, change.hidden);
    this.stage.invalidate();
  }

  /** A replay's moment: all that is exposed, and where the bit was. */
  showMoment(pose: { tip: Vec3; axis: Vec3 }, splats: Float32Array, alive: Uint32Array): void {
    this.splats?.replace(splats);
    this.setAlive(alive);
    this.setBit(pose.tip, pose.axis);
  }

  /** From now on the points stand in for the mesh along the chosen path. */
  openPointVolume(body: PointVolumeBody): void {
    const path = this.path!;
    this.splats?.dispose();
    const radius = (body.lattice.rings - 1) * body.lattice.spacing_mm;
    const surface = this.data.mesh ? new SurfacePatch(this.data.mesh, path.frame, radius) : null;
    this.splats = new SplatCloud(
      body.lattice,
      (index) => body.density_mg_cm3[index]!,
      surface,
      this.stage.bone,
    );
    this.path_group!.add(this.splats);
    const { spacing_mm, rings, discs, first_disc } = body.lattice;
    const seam = kSeam * spacing_mm;
    const low = first_disc * spacing_mm;
    this.stage.bone.uToPath.value.copy(this.stage.pathMatrix(path.frame)).invert();
    this.stage.bone.uCylinder.value.set(
      (rings - 1) * spacing_mm - seam,
      low + seam,
      low + (discs - 1) * spacing_mm - seam,
    );
    this.lattice = body.lattice;
    this.setAlive(body.alive);
  }

  /** Which points of the lattice are bone now, for the face of a cut-away; as PointVolumeBody.alive. */
  setAlive(alive: Uint32Array): void {
    if (this.lattice) this.cap?.setAlive(this.lattice, alive);
    this.stage.invalidate();
  }

  setGuides(point: Vec3 | null): void {
    if (!this.guides) return;
    this.guides.visible = point !== null;
    if (point) this.guides.setPoint(point);
    this.stage.invalidate();
  }

  setPlan(shown: boolean): void {
    this.path_groups.visible = shown;
    this.stage.invalidate();
  }

  setGlass(glass: boolean): void {
    this.bone?.setOpacity(glass ? 0 : 1);
    this.stage.invalidate();
  }

  setCutAway(on: boolean): void {
    this.cut_away = on;
    this.bone?.setSectioned(on);
    if (this.cap) this.cap.visible = on;
    if (!on) this.stage.bone.uCutNormal.value.set(0, 0, 0);
    this.stage.invalidate();
  }

  /** Down the bit, as the hand that holds it would look. */
  lookAlongBit(): void {
    const path = this.path;
    if (!path) return;
    const tip = this.stage.place(toPatient(path.frame, this.pose.tip));
    const back = new Vector3(...directionToPatient(path.frame, this.pose.axis)).negate();
    this.stage.lookAlong(back, tip, 75);
  }

  /** Across the path, near enough to see the hole's wall. */
  lookAcrossPath(): void {
    const path = this.path;
    if (!path) return;
    const [, , z] = path.frame.axes;
    const across = new Vector3(0, 0, 1).cross(new Vector3(...z));
    if (across.lengthSq() < 0.01) across.set(1, 0, 0);
    // From the side, away from the midline: the canal lies on the other.
    const outward = this.stage.place(path.frame.origin_patient).x;
    if (across.x * outward < 0) across.negate();
    across.normalize().add(new Vector3(0, 0, 0.55));
    const middle = this.stage.place(toPatient(path.frame, [0, 0, path.length_mm * 0.42]));
    this.stage.lookAlong(across, middle, 112);
  }

  /** Near the entry, over the shoulder of the hand that drills. */
  lookAtEntry(): void {
    const path = this.path;
    if (!path) return;
    const back = new Vector3(...path.frame.axes[2]).negate();
    const side = new Vector3(0, 0, 1).cross(back).normalize();
    const from = back
      .multiplyScalar(0.75)
      .addScaledVector(side, -0.45)
      .add(new Vector3(0, 0, 0.62));
    this.stage.lookAlong(from, this.stage.place(path.entry_patient), 78);
  }

  /** Where a patient point is in the picture, 0 .. 1 from its left and top; null behind the viewer. */
  pictureOf(patient: Vec3): { x: number; y: number } | null {
    const seen = this.stage.place(patient).project(this.stage.camera);
    return Math.abs(seen.z) > 1 ? null : { x: (seen.x + 1) / 2, y: (1 - seen.y) / 2 };
  }

  /** A patient point moved by CSS pixels on the screen, at its own distance from the viewer. */
  movedOnScreen(patient: Vec3, right_px: number, down_px: number): Vec3 {
    const mm = this.stage.mmPerPixel(this.stage.place(patient));
    return this.movedAcross(patient, right_px * mm, -down_px * mm, 0);
  }
  /** Moved by mm along what the eye calls right, up and away. */
  movedAcross(patient: Vec3, right_mm: number, up_mm: number, away_mm: number): Vec3 {
    const { right, up, away } = this.screenAxes();
    const moved = right.multiplyScalar(right_mm).addScaledVector(up, up_mm).addScaledVector(away, away_mm);
    return add(patient, [moved.x, moved.y, moved.z]);
  }

  isOnBit(event: { clientX: number; clientY: number }): boolean {
    return this.bit !== null && this.stage.rayAt(event).intersectObject(this.bit.grip).length > 0;
  }

  /** A drag on the screen, in CSS pixels, as mm across the bit (x, y) and along it. */
  dragOnBit(right_px: number, down_px: number): Vec3 {
    const path = this.path!;
    const { right, up } = this.screenAxes();
    const tip = this.stage.place(toPatient(path.frame, this.pose.tip));
    const mm = this.stage.mmPerPixel(tip);
    const moved = right.multiplyScalar(right_px * mm).addScaledVector(up, -down_px * mm);
    const local = directionToLocal(path.frame, [moved.x, moved.y, moved.z]);
    const [x, y] = acrossAxes(this.pose.axis);
    return [dot(local, x), dot(local, y), dot(local, this.pose.axis)];
  }

  /** The screen's right and up as unit directions in the plane across the path; always at right angles. */
  screenOnPath(): { right: [number, number]; up: [number, number] } {
    const axes = this.path?.frame.axes;
    if (!axes) return { right: [1, 0], up: [0, 1] };
    const { right, up, away } = this.screenAxes();
    const across = (v: Vector3): [number, number] => [
      v.dot(new Vector3(...axes[0])),
      v.dot(new Vector3(...axes[1])),
    ];
    return screenAcross(across(right), across(up), across(away));
  }

  private screenAxes(): { right: Vector3; up: Vector3; away: Vector3 } {
    const m = this.stage.camera.matrixWorld;
    const right = new Vector3();
    const up = new Vector3();
    const back = new Vector3();
    m.extractBasis(right, up, back);
    return { right, up, away: back.negate() };
  }

  lookFrom(key: string): void {
    this.stage.lookFrom(key, this.bone);
  }

  get view(): Matrix4 {
    return this.stage.camera.matrixWorldInverse;
  }

  private beforeFrame(seconds: number): boolean {
    if (this.cut_away) this.turnCutPlane();
    if (this.spin === 0 || !this.bit) return false;
    this.bit.turn(this.spin * seconds);
    return !matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  /** The plane holds the path's axis and faces the viewer, so the hole is open from wherever one looks. */
  private turnCutPlane(): void {
    const path = this.path;
    if (!path) return;
    const point = this.stage.place(path.frame.origin_patient);
    const axis = new Vector3(...path.frame.axes[2]);
    const normal = this.stage.camera.position.clone().sub(point);
    normal.addScaledVector(axis, -normal.dot(axis));
    if (normal.lengthSq() < 1) return;
    normal.normalize();
    this.stage.bone.uCutPoint.value.copy(point);
    this.stage.bone.uCutNormal.value.copy(normal);
    this.cap?.place(point, normal);
  }
}

function sameBit(a: DrawnPath, b: DrawnPath): boolean {
  return (
    a.id === b.id &&
    a.bit.diameter_mm === b.bit.diameter_mm &&
    a.bit.cone_length_mm === b.bit.cone_length_mm &&
    a.bit.length_mm === b.bit.length_mm
  );
}
