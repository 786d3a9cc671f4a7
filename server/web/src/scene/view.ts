/** The picture: camera, light, grid, and what moves in it. Draws only when something changed. */
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { Vec3 } from '../algebra';
import { initialPose, positionOf, type Geometry, type Pose } from '../geometry';
import { FlexibleBatch } from './batches/flexible';
import { ASKED_FOR, Drawn, type Layer, type Legend } from './build';
import { Grid } from './grid';
import { Labels } from './labels';
import type { Palette } from './palette';
import { isSoftware, Quality, rendererName } from './quality';
import { drawnBy } from './solids';
import { Trails } from './trails';
import { triad } from './triad';

/** Views along axes: where the camera stands, and what is up. */
export const VIEWS = {
  iso: { from: [1, -1.4, 0.8], up: [0, 0, 1] },
  front: { from: [0, -1, 0], up: [0, 0, 1] },
  side: { from: [1, 0, 0], up: [0, 0, 1] },
  top: { from: [0, 0, 1], up: [0, 1, 0] },
} as const;
export type ViewName = keyof typeof VIEWS;

type HandleOf = (name: string) => number | undefined;

const NEAR = 0.01, FAR = 100;  // times the model's extent
/** Room around what is drawn, when a view is chosen. */
const ROOM = 1.12;

export class View {
  readonly canvas: HTMLCanvasElement;
  onPick: (id: string | undefined) => void = () => {};

  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly perspective = new THREE.PerspectiveCamera(38, 1);
  private readonly orthographic = new THREE.OrthographicCamera();
  private camera: THREE.PerspectiveCamera | THREE.OrthographicCamera = this.perspective;
  private controls: OrbitControls;
  private readonly triad = triad();
  private readonly triadCamera = new THREE.PerspectiveCamera(30, 1, 0.1, 10);
  private readonly hidden = new Set<Layer>(ASKED_FOR);
  private handleOf: HandleOf = () => undefined;
  private grid?: Grid;
  private drawn?: Drawn;
  private ghost?: Drawn;
  private trails?: Trails;
  private labels?: Labels;
  private labelled = false;
  private geometry?: Geometry;
  private pose?: Pose;
  private ghostPose?: Pose;
  private selected?: string;
  private followed = -1;
  private followedAt?: THREE.Vector3;
  private deformation = 1;
  /** Of the ball that a view shows whole. */
  private radius = 0.5;
  private dirty = true;
  /** Drawn with all pixels since it last changed. */
  private fine = false;
  /** When the last picture was begun; undefined: the page has had its turn since. */
  private begun?: number;
  private calls = 0;
  private readonly size = new THREE.Vector2();
  private readonly quality: Quality;
  private pressedAt?: [number, number];

  constructor(parent: HTMLElement, private palette: Palette) {
    const software = isSoftware(rendererName());
    drawnBy(!software);
    this.renderer = new THREE.WebGLRenderer({ antialias: !software });
    this.renderer.info.autoReset = false;
    const sharp = Math.min(devicePixelRatio, 2);
    this.quality = software ? new Quality([1, 0.75, 0.5], 2) : new Quality([sharp, 1, 0.75], sharp);
    this.canvas = this.renderer.domElement;
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('aria-label', 'The model in three dimensions. Arrow keys turn it, + and − zoom.');
    this.canvas.setAttribute('role', 'img');
    parent.append(this.canvas);
    this.renderer.autoClear = false;
    this.controls = this.newControls();
    this.addLights(this.scene);
    this.listen();
    new ResizeObserver(() => this.resize()).observe(parent);
    this.resize();
    requestAnimationFrame((now) => this.frame(now));
  }

  // ---- what is shown

  show(geometry: Geometry, handleOf: HandleOf, keepView = false): void {
    this.clear();
    this.geometry = geometry;
    this.handleOf = handleOf;
    this.drawn = new Drawn(geometry, this.palette, handleOf);
    this.addBatches(this.drawn, 1);
    this.trails = new Trails(new THREE.Color(this.palette.trail));
    this.scene.add(this.trails.object);
    this.grid = new Grid(geometry, this.palette);
    this.scene.add(this.grid.object);
    this.setPose(initialPose(geometry.nodes));
    this.setLabels(this.labelled);
    this.setDeformation(this.deformation);
    if (!keepView) this.look('iso');
  }

  /** Another simulation in the same picture, pale. */
  compare(geometry: Geometry | undefined): void {
    if (this.ghost) this.removeBatches(this.ghost);
    this.ghost = geometry && new Drawn(geometry, this.palette, () => undefined);
    if (this.ghost) this.addBatches(this.ghost, 0.25);
    this.resize();  // tells wide lines how large the picture is
    if (geometry) this.setGhostPose(initialPose(geometry.nodes));
    this.invalidate();
  }

  setPose(pose: Pose): void {
    this.pose = pose;
    this.drawn?.update(pose);
    this.labels?.move(pose);
    this.moveWithNode();
    this.invalidate();
  }

  setGhostPose(pose: Pose): void {
    this.ghostPose = pose;
    this.ghost?.update(pose);
    this.invalidate();
  }

  setTrails(paths: Vec3[][]): void {
    this.trails?.set(paths);
    this.invalidate();
  }

  setLayer(layer: Layer, visible: boolean): void {
    if (visible) this.hidden.delete(layer);
    else this.hidden.add(layer);
    for (const drawn of [this.drawn, this.ghost])
      for (const entry of drawn?.batches ?? []) entry.batch.object.visible = !this.hidden.has(entry.layer);
    if (this.pose) this.setPose(this.pose);
    if (this.ghostPose) this.setGhostPose(this.ghostPose);
  }

  setGrid(visible: boolean): void {
    if (this.grid) this.grid.object.visible = visible;
    this.invalidate();
  }

  /** Names beside nodes and elements. */
  setLabels(visible: boolean): void {
    this.labelled = visible;
    this.labels?.element.remove();
    this.labels = visible && this.geometry ? new Labels(this.geometry) : undefined;
    if (this.labels) this.canvas.after(this.labels.element);
    if (this.pose) this.labels?.move(this.pose);
    this.invalidate();
  }

  setDeformation(factor: number): void {
    this.deformation = factor;
    for (const { batch } of this.drawn?.batches ?? []) if (batch instanceof FlexibleBatch) batch.factor = factor;
    if (this.pose) this.setPose(this.pose);
  }

  select(id: string | undefined): void {
    this.selected = id;
    const colour = new THREE.Color(this.palette.selected);
    for (const { batch } of this.drawn?.batches ?? []) batch.highlight(id, colour);
    this.invalidate();
  }

  setPalette(palette: Palette): void {
    this.palette = palette;
    if (!this.geometry) return this.invalidate();
    const pose = this.pose, ghostPose = this.ghostPose, grid = this.grid?.object.visible ?? true;
    this.show(this.geometry, this.handleOf, true);
    if (pose) this.setPose(pose);
    if (ghostPose) this.setGhostPose(ghostPose);
    this.setGrid(grid);
    this.hidden.forEach((layer) => this.setLayer(layer, false));
    this.select(this.selected);
  }

  /** Handles of the variables that a layer needs besides the poses of nodes. */
  needs(layer: Layer): number[] {
    return this.drawn?.needs(layer) ?? [];
  }

  /** What colours mean. */
  legends(): Legend[] {
    return this.drawn?.legends() ?? [];
  }

  /** Colours of values begin anew. */
  forgetColours(): void {
    this.drawn?.forgetColours();
  }

  /** Layers that have something in them. */
  layers(): Layer[] {
    return [...new Set(this.drawn?.batches.map(({ layer }) => layer) ?? [])].sort();
  }

  /** What is drawn for a node: its matrix, 16 numbers by columns, as the graphics card has it. */
  nodeMatrix(index: number): number[] {
    return Array.from(this.drawn?.nodes.matrices.subarray(16 * index, 16 * index + 16) ?? []);
  }

  // ---- how it is looked at

  look(name: ViewName): void {
    const { from, up } = VIEWS[name];
    const extent = this.geometry?.extent ?? 1, bounds = this.drawn?.bounds();
    this.radius = bounds && bounds.radius > 0 ? ROOM * bounds.radius : extent / 2;
    const target = this.followed >= 0 && this.pose ? positionOf(this.pose, this.followed) : bounds?.center.toArray() ?? [0, 0, 0];
    this.controls.target.set(...target);
    for (const camera of [this.perspective, this.orthographic]) {
      camera.up.set(up[0], up[1], up[2]);
      camera.position.set(from[0], from[1], from[2]).normalize().multiplyScalar(this.distance()).add(this.controls.target);
      camera.near = extent * NEAR;
      camera.far = extent * FAR;
    }
    this.orthographic.zoom = 1;
    const aim = this.controls.target.clone();
    this.controls.dispose();
    this.controls = this.newControls();  // they take what is up from the camera, once
    this.controls.target.copy(aim);
    this.resize();
    this.controls.update();
  }

  private newControls(): OrbitControls {
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.addEventListener('change', () => this.invalidate());
    return controls;
  }

  /** From where a ball fits into the picture, however wide or high that is. */
  private distance(radius = this.radius): number {
    const half = (this.perspective.fov * Math.PI) / 360;
    return radius / Math.sin(Math.min(half, Math.atan(this.perspective.aspect * Math.tan(half))));
  }

  /** Both projections have the same size where the camera looks at: so many lengths there are half the picture's height. */
  private get halfHeight(): number {
    if (this.camera === this.orthographic) return this.orthographic.top / this.orthographic.zoom;
    return this.camera.position.distanceTo(this.controls.target) * Math.tan((this.perspective.fov * Math.PI) / 360);
  }

  setOrthographic(on: boolean): void {
    const next = on ? this.orthographic : this.perspective, half = this.halfHeight;
    if (next === this.camera) return;
    const away = on ? this.distance() : half / Math.tan((this.perspective.fov * Math.PI) / 360);  // a parallel one cuts nothing off that is near
    next.position.copy(this.camera.position).sub(this.controls.target).setLength(away).add(this.controls.target);
    next.up.copy(this.camera.up);
    this.camera = next;
    this.controls.object = next;
    this.resize();
    if (on) this.zoomTo(half);
    this.controls.update();
    this.invalidate();
  }

  private zoomTo(halfHeight: number): void {
    this.orthographic.zoom = this.orthographic.top / halfHeight;
    this.orthographic.updateProjectionMatrix();
  }

  /** Looks at a ball, from the side that it is looked at. */
  lookAt(centre: Vec3, radius: number): void {
    const { target } = this.controls, offset = this.camera.position.clone().sub(target);
    target.set(...centre);
    if (this.camera === this.perspective) offset.setLength(this.distance(radius));
    else this.zoomTo(radius / Math.min(1, this.perspective.aspect));
    this.camera.position.copy(target).add(offset);
    this.controls.update();
    this.invalidate();
  }

  /** The camera moves along with a node; −1: it stays. */
  follow(node: number): void {
    this.followed = node;
    this.followedAt = undefined;
    this.moveWithNode();
  }

  private moveWithNode(): void {
    if (this.followed < 0 || !this.pose) return;
    const at = new THREE.Vector3(...positionOf(this.pose, this.followed));
    const moved = at.clone().sub(this.followedAt ?? this.controls.target);
    this.controls.target.add(moved);
    this.camera.position.add(moved);
    this.followedAt = at;
    this.controls.update();
  }

  /** Turns the camera about the target by angles in radians. */
  turn(horizontal: number, vertical: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target);
    offset.applyAxisAngle(this.camera.up, horizontal);
    const side = new THREE.Vector3().crossVectors(offset, this.camera.up).normalize();
    const tilted = offset.clone().applyAxisAngle(side, vertical);
    if (Math.abs(tilted.clone().normalize().dot(this.camera.up)) < 0.995) offset.copy(tilted);
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.invalidate();
  }

  zoom(factor: number): void {
    if (this.camera === this.orthographic) {
      this.orthographic.zoom *= factor;
      this.orthographic.updateProjectionMatrix();
    } else {
      this.camera.position.sub(this.controls.target).multiplyScalar(1 / factor).add(this.controls.target);
    }
    this.controls.update();
    this.invalidate();
  }

  picture(): Promise<Blob | null> {
    this.render(this.quality.still);  // what was drawn before is gone from the buffer
    return new Promise((resolve) => this.canvas.toBlob(resolve, 'image/png'));
  }

  invalidate(): void {
    this.dirty = true;
  }

  /** Calls to the graphics card in the last picture. */
  get drawCalls(): number {
    return this.calls;
  }

  /** Length of the grid's cells; 0: nothing is shown. */
  get cell(): number {
    return this.grid?.cell ?? 0;
  }

  // ---- the inside

  private addBatches(drawn: Drawn, opacity: number): void {
    for (const { layer, batch } of drawn.batches) {
      batch.object.visible = !this.hidden.has(layer);
      this.scene.add(batch.object);
      if (opacity < 1) batch.object.traverse((object) => fade(object, opacity));
    }
  }

  private removeBatches(drawn: Drawn): void {
    for (const { batch } of drawn.batches) {
      this.scene.remove(batch.object);
      batch.dispose();
    }
  }

  private clear(): void {
    if (this.drawn) this.removeBatches(this.drawn);
    for (const lines of [this.trails?.object, this.grid?.object]) {
      if (!lines) continue;
      this.scene.remove(lines);
      lines.geometry.dispose();
      lines.material.dispose();
    }
    this.drawn = undefined;
  }

  private addLights(scene: THREE.Scene): void {
    scene.add(new THREE.HemisphereLight(0xffffff, 0x667788, 1.7));
    const sun = new THREE.DirectionalLight(0xffffff, 1.9);
    sun.position.set(2, -3, 5);
    scene.add(sun);
  }

  private resize(): void {
    const parent = this.canvas.parentElement;
    const width = Math.max(parent?.clientWidth ?? 1, 1), height = Math.max(parent?.clientHeight ?? 1, 1);
    this.renderer.setSize(width, height);
    this.perspective.aspect = width / height;
    this.perspective.updateProjectionMatrix();
    const half = this.radius / Math.min(1, width / height);
    Object.assign(this.orthographic, { left: (-half * width) / height, right: (half * width) / height, top: half, bottom: -half });
    this.orthographic.updateProjectionMatrix();
    this.scene.traverse((object) => {
      const material = (object as THREE.Mesh).material;
      if (material instanceof LineMaterial) material.resolution.set(width, height);
    });
    this.invalidate();
  }

  /** Once for each turn of the page: draws what changed, and once more, finely, what then rests. */
  private frame(now: number): void {
    requestAnimationFrame((next) => this.frame(next));
    if (this.begun !== undefined) this.quality.took(this.begun, now);
    this.begun = undefined;
    if (this.dirty) {
      this.begun = now;
      this.render(this.quality.ratio);
      this.fine = this.quality.ratio >= this.quality.still;
    } else if (!this.fine && this.quality.rests(now)) {
      this.render(this.quality.still);
      this.fine = true;
    }
  }

  private render(ratio: number): void {
    this.dirty = false;
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.renderer.getSize(this.size);
    const { width, height } = this.size;
    this.renderer.setClearColor(this.palette.background);
    this.renderer.setViewport(0, 0, width, height);
    this.renderer.info.reset();
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.triadCamera.position.copy(this.camera.position).sub(this.controls.target).setLength(4.2);
    this.triadCamera.up.copy(this.camera.up);
    this.triadCamera.lookAt(0, 0, 0);
    const corner = Math.min(96, height / 4);
    this.renderer.clearDepth();
    this.renderer.setViewport(8, 8, corner, corner);
    this.renderer.render(this.triad, this.triadCamera);
    this.labels?.place(this.camera, width, height);
    this.calls = this.renderer.info.render.calls;
  }

  private listen(): void {
    this.canvas.addEventListener('pointerdown', (event) => (this.pressedAt = [event.clientX, event.clientY]));
    this.canvas.addEventListener('pointerup', (event) => {
      const [x, y] = this.pressedAt ?? [Infinity, Infinity];
      if (Math.hypot(event.clientX - x, event.clientY - y) < 5) this.onPick(this.hit(event));
    });
    const steps: Record<string, () => void> = {
      ArrowLeft: () => this.turn(-0.1, 0),
      ArrowRight: () => this.turn(0.1, 0),
      ArrowUp: () => this.turn(0, 0.1),
      ArrowDown: () => this.turn(0, -0.1),
      '+': () => this.zoom(1.15),
      '=': () => this.zoom(1.15),
      '-': () => this.zoom(1 / 1.15),
    };
    this.canvas.addEventListener('keydown', (event) => {
      const step = steps[event.key];
      if (!step) return;
      step();
      event.preventDefault();
      event.stopPropagation();
    });
  }

  private hit(event: PointerEvent): string | undefined {
    const box = this.canvas.getBoundingClientRect();
    const at = new THREE.Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
    const ray = new THREE.Raycaster();
    ray.params.Points.threshold = ray.params.Line.threshold = (this.geometry?.extent ?? 1) * 0.01;
    ray.setFromCamera(at, this.camera);
    let nearest: { distance: number; id: string } | undefined;
    for (const { batch } of this.drawn?.batches ?? []) {
      if (!batch.object.visible) continue;
      const hit = ray.intersectObject(batch.object, true)[0];
      const id = hit && batch.idOf(hit);
      if (id && (!nearest || hit.distance < nearest.distance)) nearest = { distance: hit.distance, id };
    }
    return nearest?.id;
  }
}

function fade(object: THREE.Object3D, opacity: number): void {
  const material = (object as THREE.Mesh).material;
  if (!(material instanceof THREE.Material)) return;
  material.transparent = true;
  material.opacity *= opacity;
  material.depthWrite = false;
}
