// The canvas: renderer, camera, orbit, what is where. Draws only when something changed.
import {
  Box3,
  Color,
  DirectionalLight,
  Group,
  HemisphereLight,
  Matrix4,
  type Object3D,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Vec3 } from "../contract/bodies";
import type { PathFrame } from "../contract/rest";
import { makeBoneUniforms } from "./shading";

/** Directions, patient axes (LPS), from which a picture is taken. */
export const kViewpoints: Record<string, { from: Vec3; up: Vec3; name: string }> = {
  P: { from: [0, 1, 0], up: [0, 0, 1], name: "from the back" },
  A: { from: [0, -1, 0], up: [0, 0, 1], name: "from the front" },
  L: { from: [1, 0, 0], up: [0, 0, 1], name: "from the left" },
  R: { from: [-1, 0, 0], up: [0, 0, 1], name: "from the right" },
  H: { from: [0, 0.001, 1], up: [0, 0, 1], name: "from the head" },
  F: { from: [0, 0.001, -1], up: [0, 0, 1], name: "from the feet" },
};

const kSlow_ms = 80;

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(28, 1, 1, 2000);
  readonly bone = makeBoneUniforms();
  /** Children are placed in patient mm, less `centre`. */
  readonly world = new Group();
  readonly controls: OrbitControls;
  /** Before each picture; returns true to ask for the next one too. */
  onFrame: ((seconds: number) => boolean) | null = null;
  /** After each picture: the camera's rotation, for the little axes. */
  onView: ((view: Matrix4) => void) | null = null;
  onLost: ((lost: boolean) => void) | null = null;
  private readonly renderer: WebGLRenderer;
  private readonly observer: ResizeObserver;
  private readonly lamp = new DirectionalLight(0xffffff, 2.6);
  private wanted = false;
  private gone = false;
  /** From one picture's start to when the browser was ready for the next. */
  private cost_ms = 0;
  private last_ms = 0;
  private home = 100;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    readonly centre: Vec3,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true });
    this.renderer.setClearColor(new Color(0x000000), 0);
    this.scene.add(this.world, new HemisphereLight(0xdfe9f2, 0x2b2622, 1.1), this.camera);
    this.camera.add(this.lamp);
    this.lamp.position.set(-0.45, 0.65, 0.75);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.rotateSpeed = 0.9;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 8;
    this.controls.maxDistance = 900;
    this.controls.addEventListener("change", () => this.invalidate());
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas.parentElement!);
    canvas.addEventListener("webglcontextlost", this.lost);
    canvas.addEventListener("webglcontextrestored", this.restored);
    this.resize();
  }

  private readonly lost = (event: Event): void => {
    event.preventDefault();
    this.onLost?.(true);
  };
  private readonly restored = (): void => {
    this.onLost?.(false);
    this.invalidate();
  };

  dispose(): void {
    this.gone = true;
    this.observer.disconnect();
    this.controls.dispose();
    this.canvas.removeEventListener("webglcontextlost", this.lost);
    this.canvas.removeEventListener("webglcontextrestored", this.restored);
    this.renderer.dispose();
  }

  invalidate(): void {
    if (this.wanted) return;
    this.wanted = true;
    // A machine that draws slowly gets as long a rest as a picture took, so that keys and sliders stay quick.
    const rest_ms = this.cost_ms > kSlow_ms ? Math.min(this.cost_ms, 500) : 0;
    if (rest_ms === 0) requestAnimationFrame((now) => this.draw(now));
    else setTimeout(() => requestAnimationFrame((now) => this.draw(now)), rest_ms);
  }

  private draw(now: number): void {
    if (this.gone) return;
    this.wanted = false;
    const seconds = this.last_ms === 0 ? 0 : Math.min(0.1, (now - this.last_ms) / 1000);
    this.last_ms = now;
    const again = this.onFrame?.(seconds) ?? false;
    this.renderer.render(this.scene, this.camera);
    requestAnimationFrame((next) => {
      this.cost_ms = next - now;
    });
    this.onView?.(this.camera.matrixWorldInverse);
    if (again) this.invalidate();
    else this.last_ms = 0;
  }

  /** A group whose children are placed in the path frame. */
  pathGroup(frame: PathFrame): Group {
    const group = new Group();
    group.matrixAutoUpdate = false;
    this.movePathGroup(group, frame);
    this.world.add(group);
    return group;
  }
  movePathGroup(group: Group, frame: PathFrame): void {
    group.matrix.copy(this.pathMatrix(frame));
    group.matrixWorldNeedsUpdate = true;
  }

  pathMatrix(frame: PathFrame): Matrix4 {
    const [x, y, z] = frame.axes.map((axis) => new Vector3(...axis)) as [Vector3, Vector3, Vector3];
    return new Matrix4().makeBasis(x, y, z).setPosition(this.place(frame.origin_patient));
  }

  place(patient: Vec3): Vector3 {
    return new Vector3(patient[0] - this.centre[0], patient[1] - this.centre[1], patient[2] - this.centre[2]);
  }

  /** Looks at all of `object`, from the viewpoint. */
  lookFrom(key: string, object: Object3D | null): void {
    const view = kViewpoints[key]!;
    if (object) {
      const box = new Box3().setFromObject(object);
      box.getCenter(this.controls.target);
      this.home = box.getSize(new Vector3()).length() * 1.02;
    }
    this.lookAlong(new Vector3(...view.from), this.controls.target.clone(), this.home * 1.45);
  }

  /** From `target`, back along `from` by `distance` mm. */
  lookAlong(from: Vector3, target: Vector3, distance: number): void {
    this.controls.target.copy(target);
    const narrow = Math.max(1, 1.15 / this.camera.aspect);
    this.camera.position.copy(target).addScaledVector(from.clone().normalize(), distance * narrow);
    this.controls.update();
    this.invalidate();
  }

  zoomBy(factor: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.invalidate();
  }

  /** Turns about the target, for keys. */
  orbitBy(across: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(new Vector3(0, 0, 1), across);
    const right = new Vector3().crossVectors(new Vector3(0, 0, 1), offset).normalize();
    const tilted = offset.clone().applyAxisAngle(right, -up);
    if (Math.abs(tilted.clone().normalize().z) < 0.995) offset.copy(tilted);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.invalidate();
  }

  rayAt(event: { clientX: number; clientY: number }): Raycaster {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(
      ((event.clientX - box.left) / box.width) * 2 - 1,
      1 - ((event.clientY - box.top) / box.height) * 2,
    );
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    return ray;
  }

  /** Millimetres that one CSS pixel spans at a point of the scene. */
  mmPerPixel(at: Vector3): number {
    const distance = at.clone().sub(this.camera.position).length();
    return (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360)) / this.canvas.clientHeight;
  }

  private resize(): void {
    const holder = this.canvas.parentElement!;
    const width = Math.max(1, holder.clientWidth);
    const height = Math.max(1, holder.clientHeight);
    const ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.getDrawingBufferSize(this.bone.uViewport.value);
    this.invalidate();
  }
}
