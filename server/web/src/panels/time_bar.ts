/** Time: run, pause, step, run until; and what was recorded, as a slider. */
import type { Desk } from '../desk';
import { complain, h, iconButton, icon, numberField, numberIn } from '../dom';
import { SimulationState } from '../gen/mbcosim/v1/simulations_pb';
import { clock } from '../format';

const SPEEDS = [0.01, 0.1, 0.25, 0.5, 1, 2, 5, 10, Infinity];

export class TimeBar {
  readonly element: HTMLElement;
  private readonly play: HTMLButtonElement;
  private readonly live = h('button', { type: 'button', class: 'button live', 'aria-pressed': 'true', onclick: () => this.goLive() }, 'live');
  private readonly slider = h('input', { type: 'range', min: 0, max: 1, step: 'any', value: 1, 'aria-label': 'Time looked at' });
  private readonly time = h('output', { 'aria-label': 'Time' });
  private readonly until = numberField({ placeholder: 'until [s]', inputmode: 'decimal', 'aria-label': 'Run until, in seconds' });
  private readonly speed = h('select', { 'aria-label': 'Speed' }, ...SPEEDS.map((speed) => h('option', { value: speed }, Number.isFinite(speed) ? `${speed} ×` : 'full speed')));
  private readonly loop: HTMLButtonElement;
  private readonly controls: HTMLElement[];
  private replaying = false;
  private replayed = 0;
  private unwatch: (() => void)[] = [];

  constructor(private readonly desk: Desk) {
    this.play = h('button', { type: 'button', class: 'icon-button play', onclick: () => this.toggle() }, icon('play'));
    this.loop = iconButton('loop', 'Replay what was recorded, in a loop', () => this.toggleLoop(), { 'aria-pressed': 'false', class: 'icon-button loop' });
    const step = iconButton('step', 'One step (S)', () => this.step(1));
    const ten = h('button', { type: 'button', class: 'button', title: 'Ten steps', onclick: () => this.step(10) }, '+10');
    const run = iconButton('until', 'Run until this time', () => this.runUntil());
    this.speed.value = '1';
    this.speed.addEventListener('change', () => desk.alive?.setSpeed(Number(this.speed.value)));
    this.slider.addEventListener('input', () => this.look());
    this.until.addEventListener('keydown', (event) => event.key === 'Enter' && this.runUntil());
    this.controls = [this.play, step, ten, this.until, run, this.speed, this.live];
    this.element = h('footer', { class: 'time', 'aria-label': 'Time' }, this.play, step, ten, this.until, run,
      h('div', { class: 'slider' }, this.slider, this.time), this.loop, this.live, this.speed);
    desk.shown.watch(() => this.connect());
    desk.frame.watch(() => this.update());
    desk.cursor.watch(() => this.update());
  }

  toggle(): void {
    const session = this.desk.alive;
    if (!session) return this.toggleLoop();
    this.goLive();
    if (session.playing.value === 'no') session.play();
    else session.pause();
  }

  step(count: number): void {
    this.goLive();
    void this.desk.alive?.step(count);
  }

  /** Looks one recorded sample back or on. */
  nudge(by: number): void {
    const recording = this.desk.shown.value?.recording, sample = this.desk.sample;
    if (!recording || !sample) return;
    const at = recording.indexAt(sample.time) + by;
    this.desk.cursor.value = recording.samples[Math.min(Math.max(at, 0), recording.samples.length - 1)].time;
  }

  goLive(): void {
    this.replaying = false;
    this.loop.setAttribute('aria-pressed', 'false');
    if (this.desk.session) this.desk.cursor.value = undefined;
  }

  private runUntil(): void {
    const time = numberIn(this.until), session = this.desk.alive;
    if (Number.isNaN(time)) return this.until.focus();
    if (session && time <= session.info.value.time) return complain(this.until, 'The simulation has reached this time.');
    this.goLive();
    void session?.runUntil(time);
  }

  private look(): void {
    const samples = this.desk.shown.value?.recording.samples ?? [];
    if (samples.length === 0) return;
    const first = samples[0].time, last = samples[samples.length - 1].time;
    this.replaying = false;
    this.loop.setAttribute('aria-pressed', 'false');
    this.desk.cursor.value = first + this.slider.valueAsNumber * (last - first);
  }

  private toggleLoop(): void {
    this.replaying = !this.replaying;
    this.loop.setAttribute('aria-pressed', String(this.replaying));
    if (!this.replaying) return this.update();
    this.replayed = performance.now();
    const samples = this.desk.shown.value?.recording.samples ?? [];
    let time = this.desk.cursor.value ?? samples[0]?.time ?? 0;
    const frame = (now: number) => {
      if (!this.replaying || samples.length === 0) return;
      const speed = Number(this.speed.value), first = samples[0].time, last = samples[samples.length - 1].time;
      time += ((now - this.replayed) / 1000) * (Number.isFinite(speed) ? speed : 1);
      this.replayed = now;
      if (time > last) time = first;
      this.desk.cursor.value = time;
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    this.update();
  }

  private connect(): void {
    this.unwatch.forEach((end) => end());
    this.replaying = false;
    const session = this.desk.session;
    this.unwatch = session ? [session.playing.watch(() => this.update()), session.info.watch(() => this.update()), session.gone.watch(() => this.offer())] : [];
    this.offer();
    if (session) this.speed.value = String(session.speed.value);
  }

  /** Without a simulation that can be advanced, what was recorded can be played. */
  private offer(): void {
    for (const control of this.controls) control.classList.toggle('hidden', !this.desk.alive && control !== this.speed && control !== this.play);
    this.update();
  }

  private update(): void {
    const session = this.desk.alive, samples = this.desk.shown.value?.recording.samples ?? [];
    const running = session ? session.playing.value !== 'no' : this.replaying;
    const label = running ? 'Pause (space)' : session ? 'Run (space)' : 'Play (space)';
    if (this.play.title !== label) {
      this.play.title = label;
      this.play.setAttribute('aria-label', label);
      this.play.replaceChildren(icon(running ? 'pause' : 'play'));
    }
    this.play.disabled = session?.info.value.state === SimulationState.FINISHED;
    this.live.setAttribute('aria-pressed', String(this.desk.cursor.value === undefined));
    const sample = this.desk.sample;
    this.time.textContent = sample ? clock(sample.time, this.desk.shown.value?.model.step ?? 0) : '';
    const first = samples[0]?.time ?? 0, last = samples[samples.length - 1]?.time ?? 0;
    if (sample && document.activeElement !== this.slider) this.slider.value = String(last > first ? (sample.time - first) / (last - first) : 1);
    this.slider.setAttribute('aria-valuetext', this.time.textContent);
    this.slider.disabled = samples.length < 2;
  }
}
