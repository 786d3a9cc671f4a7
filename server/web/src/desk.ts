/** What the parts of the page share: the simulation on show, the time looked at, what is selected, what is plotted. */
import { oncePerFrame } from './dom';
import type { Sample } from './recording';
import { Session, type Shown } from './session';
import { Signal } from './signal';
import type { VariableInfo } from './model';

export interface Curve {
  variable: VariableInfo;
  element: number;
}

export interface Plot {
  id: number;
  curves: Curve[];
  /** Abscissa; absent: time. */
  against?: Curve;
}

/** Numbers of a variable that are plotted at once. Of more the reader chooses. */
export const MOST_CURVES = 9;

/** A few times a second is so often; what is drawn then has at most such a part of all time. */
const CALM_MILLISECONDS = 100, CALM_PART = 0.2;

export class Desk {
  readonly shown = new Signal<Shown | undefined>(undefined);
  /** Time looked at; undefined: the newest. */
  readonly cursor = new Signal<number | undefined>(undefined);
  readonly selected = new Signal<string | undefined>(undefined);
  readonly plots = new Signal<Plot[]>([]);
  readonly theme = new Signal<'dark' | 'light'>('dark');
  /** Once for each frame of the screen in which something changed. */
  readonly frame = new Signal(0);
  /** A few times a second while something changes: for what is read, not watched. */
  readonly calm = new Signal(0);
  private calmed = true;
  private calmMilliseconds = CALM_MILLISECONDS;
  private readonly askForFrame = oncePerFrame(() => (this.frame.value += 1));
  private unwatch = () => {};
  private nextPlot = 1;

  constructor() {
    this.shown.watch((shown) => {
      this.unwatch();
      this.unwatch = shown ? shown.changed.watch(() => this.invalidate()) : () => {};
      this.invalidate();
    });
    this.cursor.watch(() => this.invalidate());
  }

  get session(): Session | undefined {
    return this.shown.value instanceof Session ? this.shown.value : undefined;
  }

  /** The simulation on show, as long as something can be done with it. */
  get alive(): Session | undefined {
    return this.session?.gone.value ? undefined : this.session;
  }

  /** The sample at the time looked at. */
  get sample(): Sample | undefined {
    const recording = this.shown.value?.recording;
    if (!recording) return undefined;
    if (this.cursor.value === undefined) return recording.last;
    return recording.samples[recording.indexAt(this.cursor.value)];
  }

  invalidate(): void {
    if (this.askForFrame()) this.invalidateCalm();
  }

  private invalidateCalm(): void {
    if (!this.calmed) return;
    this.calmed = false;
    setTimeout(() => {
      this.calmed = true;
      const begun = performance.now();
      this.calm.value += 1;
      this.calmMilliseconds = Math.max(CALM_MILLISECONDS, (performance.now() - begun) / CALM_PART);
    }, this.calmMilliseconds);
  }

  show(shown: Shown | undefined): void {
    this.session?.close();
    this.cursor.value = undefined;
    this.selected.value = undefined;
    this.plots.value = [];
    this.shown.value = shown;
  }

  /** A new plot with curves of all numbers of a variable; of many only the first. */
  plot(variable: VariableInfo): void {
    this.session?.want([variable]);
    const curves = Array.from({ length: variable.size <= MOST_CURVES ? variable.size : 1 }, (_, element) => ({ variable, element }));
    this.plots.value.push({ id: this.nextPlot++, curves });
    this.plots.notify();
    this.invalidate();
  }

  addCurve(plot: Plot, curve: Curve): void {
    plot.curves.push(curve);
    this.plots.notify();
  }

  unplot(plot: Plot, curve?: Curve): void {
    if (curve) plot.curves = plot.curves.filter((other) => other !== curve);
    if (!curve || plot.curves.length === 0) this.plots.value = this.plots.value.filter((other) => other !== plot);
    this.plots.notify();
  }
}
