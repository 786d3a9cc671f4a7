/** The scene with its tools. */
import { add, norm, scale, subtract, vec3, type Vec3 } from '../algebra';
import type { Desk } from '../desk';
import { h, icon, iconButton } from '../dom';
import { clock, number, ticks } from '../format';
import { pointAt, PoseReader, positionOf, type Pose } from '../geometry';
import { variableNamed } from '../model';
import { amplitude, MovedPose, type Mode } from '../modes';
import { ASKED_FOR, type Layer, type Legend } from '../scene/build';
import { DARK, LIGHT } from '../scene/palette';
import { View, type ViewName } from '../scene/view';
import type { Session, Shown } from '../session';

const LAYERS: [Layer, string][] = [
  ['bodies', 'bodies'], ['joints', 'joints'], ['beams', 'beams'], ['lines', 'rods and springs'], ['surfaces', 'shells'], ['flexible', 'flexible bodies'],
  ['forces', 'forces and moments'], ['reactions', 'reactions of joints'], ['velocities', 'velocities of nodes'], ['links', 'links to nodes'], ['nodes', 'nodes'], ['axes', 'axes of nodes and joints'],
];
const TRAIL_SAMPLES = 2000;
/** What is looked at from near by has so much room around it, and is at least such a part of the model's extent. */
const ROOM = 1.3, LEAST_LOOK = 0.12;
/** Modes are shown at this pace, whatever their frequency. */
const MODE_HERTZ = 0.8;

export class ScenePanel {
  readonly element = h('div', { class: 'scene' });
  readonly view: View;
  /** Nodes whose paths are drawn, by index. */
  private readonly trails = new Set<number>();
  private readonly layers = new Map(LAYERS.map(([layer, name]) => [layer, check(name, !ASKED_FOR.includes(layer), (on) => this.setLayer(layer, on))]));
  private readonly deformation = h('label');
  private readonly hud = h('div', { class: 'hud', role: 'status', 'aria-live': 'off' });
  private readonly following: HTMLElement = iconButton('follow', 'Follow the selected node (F)',
    () => this.follow(this.following.getAttribute('aria-pressed') === 'true' ? undefined : this.desk.selected.value), { 'aria-pressed': 'false' });
  private reader = new PoseReader([]);
  /** That is drawn; undefined: nothing is yet. */
  private pose?: Pose;
  private other?: Session;
  private otherReader = new PoseReader([]);
  private mode?: { mode: Mode; factor: number; pose: MovedPose };
  private unwatchOther = () => {};
  private readonly otherName = h('span', { class: 'name' });
  private readonly comparing = h('div', { class: 'toolbar comparing hidden' }, this.otherName,
    iconButton('close', 'Compare no more', () => this.compareWith(undefined), { class: 'icon-button small' }));

  constructor(private readonly desk: Desk) {
    this.view = new View(this.element, DARK);
    this.view.onPick = (id) => (desk.selected.value = id);
    this.element.append(h('div', { class: 'tools' }, this.layerTools(), this.viewTools(), this.comparing), this.hud);
    desk.theme.watch((theme) => this.view.setPalette(theme === 'dark' ? DARK : LIGHT));
    desk.shown.watch((shown) => {
      this.trails.clear();
      this.compareWith(undefined);
      this.follow(undefined);
      this.mode = undefined;
      this.reader = new PoseReader(shown?.geometry.nodes ?? []);
      this.pose = undefined;
      if (shown) this.show(shown);
    });
    desk.selected.watch((id) => this.view.select(id));
    desk.frame.watch(() => this.update());
  }

  private show(shown: Shown): void {
    this.view.show(shown.geometry, (name) => variableNamed(shown.model.variables, name)?.handle);
    const present = new Set(this.view.layers());
    for (const [layer, entry] of this.layers) entry.classList.toggle('hidden', !present.has(layer));
    this.deformation.classList.toggle('hidden', !present.has('flexible'));
    for (const [layer, entry] of this.layers) if (entry.querySelector('input')?.checked) this.wantFor(layer);
  }

  /** Follows the variables that a layer is drawn from. */
  private wantFor(layer: Layer): void {
    const wanted = new Set(this.view.needs(layer));
    if (wanted.size > 0) this.desk.session?.want(this.desk.session.model.variables.filter((variable) => wanted.has(variable.handle)));
  }

  private setLayer(layer: Layer, on: boolean): void {
    if (on) this.wantFor(layer);
    this.view.setLayer(layer, on);
  }

  /** Index of the structural node with the identifier "node.structural:7"; −1: none. */
  private nodeIndex(id: string | undefined): number {
    const nodes = this.desk.shown.value?.geometry.nodes ?? [];
    return nodes.findIndex((node) => `node.structural:${node.label}` === id);
  }

  follow(id: string | undefined): void {
    const node = this.nodeIndex(id);
    this.view.follow(node);
    this.following.setAttribute('aria-pressed', String(node >= 0));
  }

  /** Looks at the node or element from near by. */
  lookAt(id: string | undefined): void {
    const geometry = this.desk.shown.value?.geometry, node = this.nodeIndex(id);
    const shape = geometry?.elements.find((element) => element.id === id);
    if (!geometry || !this.pose) return;
    const pose = this.pose, points = node >= 0 ? [positionOf(pose, node)] : shape?.points.map((point) => pointAt(pose, point)) ?? [];
    if (points.length === 0) return;
    const centre = scale(points.reduce(add), 1 / points.length);
    const reach = Math.max(...points.map((point) => norm(subtract(point, centre))));
    this.view.lookAt(centre, Math.max(ROOM * reach, LEAST_LOOK * geometry.extent));
  }

  toggleTrail(): void {
    const node = this.nodeIndex(this.desk.selected.value);
    const nodes = node >= 0 ? [node] : this.attachedNodes();
    for (const index of nodes) if (!this.trails.delete(index)) this.trails.add(index);
    this.desk.invalidate();
  }

  private attachedNodes(): number[] {
    const shape = this.desk.shown.value?.geometry.elements.find((element) => element.id === this.desk.selected.value);
    return [...new Set(shape?.points.map((point) => point.node).filter((node) => node >= 0) ?? [])];
  }

  /** Draws another simulation in the same picture; undefined: none. */
  compareWith(session: Session | undefined): void {
    this.unwatchOther();
    this.other?.close();
    this.other = session;
    this.otherReader = new PoseReader(session?.geometry.nodes ?? []);
    this.view.compare(session?.geometry);
    this.comparing.classList.toggle('hidden', session === undefined);
    this.otherName.textContent = `pale: ${session?.title ?? ''}`;
    this.unwatchOther = session ? session.changed.watch(() => this.desk.invalidate()) : () => {};
  }

  /** Shows a mode about the sample looked at, `size` times the model large; undefined: none. */
  animate(mode: Mode | undefined, size: number): void {
    const extent = this.desk.shown.value?.geometry.extent ?? 1;
    const idle = this.mode === undefined;
    this.view.forgetColours();
    this.mode = mode && { mode, factor: amplitude(mode, size * extent), pose: new MovedPose(this.reader) };
    if (this.mode && idle) this.vibrate();
    else this.desk.invalidate();
  }

  private vibrate(): void {
    requestAnimationFrame(() => {
      if (!this.mode) return this.desk.invalidate();
      this.update();
      this.vibrate();
    });
  }

  private update(): void {
    const shown = this.desk.shown.value, sample = this.desk.sample;
    if (!shown || !sample) return this.hud.replaceChildren();
    const pose = this.reader.read(sample);
    const phase = (performance.now() / 1000) * 2 * Math.PI * MODE_HERTZ;
    this.pose = this.mode ? this.mode.pose.move(pose, this.mode.mode, phase, this.mode.factor) : pose;
    this.view.setPose(this.pose);
    this.updateOther(sample.time);
    this.view.setTrails([...this.trails].map((node) => this.path(node)));
    this.hud.replaceChildren(h('strong', {}, clock(sample.time, shown.model.step)), h('div', { class: 'soft' }, `step ${sample.step}`), h('div', { class: 'soft' }, `grid ${number(this.view.cell, 3)}${this.unit(shown)}`),
      ...this.view.legends().map((known) => legend(known, this.unit(shown, known.handle))));
  }

  /** Of a variable; of lengths without one. */
  private unit({ model, geometry }: Shown, handle = geometry.nodes[0]?.positionHandle): string {
    const unit = model.variables.find((variable) => variable.handle === handle)?.unit;
    return unit && model.unitsDeclared ? ` ${unit}` : '';
  }

  private updateOther(time: number): void {
    const recording = this.other?.recording;
    const sample = recording && (this.desk.cursor.value === undefined ? recording.last : recording.samples[recording.indexAt(time)]);
    if (this.other && sample) this.view.setGhostPose(this.otherReader.read(sample));
  }

  private path(node: number): Vec3[] {
    const shown = this.desk.shown.value, last = this.desk.sample;
    if (!shown || !last) return [];
    const samples = shown.recording.samples, end = shown.recording.indexAt(last.time);
    const stride = Math.max(1, Math.ceil((end + 1) / TRAIL_SAMPLES));
    const path: Vec3[] = [], handle = shown.geometry.nodes[node].positionHandle;
    for (let i = 0; i <= end; i += stride) {
      const at = samples[i].layout.offset(handle);
      if (at !== undefined) path.push(vec3(samples[i].values, at));
    }
    return path;
  }

  private layerTools(): HTMLElement {
    const deformation = h('input', { type: 'range', min: 0, max: 3, step: 0.05, value: 0, 'aria-label': 'Deformation scale' });
    const times = h('span', { class: 'number' }, '× 1');
    deformation.addEventListener('input', () => {
      const factor = 10 ** deformation.valueAsNumber;
      times.textContent = `× ${number(factor, 2)}`;
      this.view.setDeformation(factor);
    });
    this.deformation.append('deformation', deformation, times);
    const menu = h('div', { class: 'menu hidden' },
      ...this.layers.values(),
      check('names', false, (on) => this.view.setLabels(on)),
      check('grid', true, (on) => this.view.setGrid(on)),
      this.deformation);
    const button = h('button', { type: 'button', class: 'button', 'aria-expanded': 'false', onclick: () => toggle(button, menu) }, icon('layers'), 'Show');
    const trail = h('button', { type: 'button', class: 'button', title: 'Draw the path of the selected node (T)', onclick: () => this.toggleTrail() }, icon('wave'), 'Trail');
    return h('div', { class: 'toolbar layers' }, h('div', { class: 'anchor' }, button, menu), trail);
  }

  private viewTools(): HTMLElement {
    const look = (name: ViewName, label: string) => h('button', { type: 'button', class: 'button', title: `View: ${name}`, onclick: () => this.view.look(name) }, label);
    let flat = false;
    const orthographic = h('button', { type: 'button', class: 'button', 'aria-pressed': 'false', title: 'Parallel projection (O)', onclick: () => {
      flat = !flat;
      orthographic.setAttribute('aria-pressed', String(flat));
      this.view.setOrthographic(flat);
    } }, 'ortho');
    return h('div', { class: 'toolbar views' }, look('front', 'X–Z'), look('side', 'Y–Z'), look('top', 'X–Y'), iconButton('fit', 'Whole model (H)', () => this.view.look('iso')), orthographic, this.following);
  }
}

/** What the colours between two ends mean. */
function legend({ name, least, largest, low, high }: Legend, unit: string): HTMLElement {
  const [from, to] = ticks([least, largest], (largest - least) / 10);
  return h('div', { class: 'scale', style: `--low:${low};--high:${high}` }, h('span', {}, name), h('span', { class: 'number' }, from), h('i'), h('span', { class: 'number' }, `${to}${unit}`));
}

function check(name: string, on: boolean, change: (on: boolean) => void): HTMLElement {
  const box = h('input', { type: 'checkbox', checked: on, onchange: () => change(box.checked) });
  return h('label', {}, box, name);
}

/** Opens and closes a menu; a click elsewhere and Escape close it. */
export function toggle(button: HTMLElement, menu: HTMLElement): void {
  const open = menu.classList.toggle('hidden') === false;
  button.setAttribute('aria-expanded', String(open));
  if (!open) return;
  const close = (event: Event) => {
    if (event instanceof KeyboardEvent ? event.key !== 'Escape' : menu.contains(event.target as Node) || button.contains(event.target as Node)) return;
    if (menu.contains(document.activeElement)) button.focus();
    menu.classList.add('hidden');
    button.setAttribute('aria-expanded', 'false');
    document.removeEventListener('pointerdown', close);
    document.removeEventListener('keydown', close);
  };
  document.addEventListener('pointerdown', close);
  document.addEventListener('keydown', close);
}
