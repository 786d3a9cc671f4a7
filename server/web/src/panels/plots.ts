/** Plots of chosen variables against time, or against each other. */
import uPlot from 'uplot';
import { MOST_CURVES, type Curve, type Desk, type Plot } from '../desk';
import { arrange, h, iconButton, replace } from '../dom';
import { componentName, curveName, ticks, unitOf } from '../format';
import { shortName, type VariableInfo } from '../model';
import { valueOf, type Layout, type Sample } from '../recording';
import { trace, type Value } from '../trace';

const COLOURS = {
  dark: ['#4aa8ff', '#f0a13c', '#35c2a8', '#ff7676', '#b980ff', '#c9b458', '#d86f9a', '#8fd3ff', '#e3eaf1'],
  light: ['#0b63c4', '#b45f00', '#00755f', '#c22222', '#6d35c4', '#766300', '#a92a60', '#2f86b8', '#17212c'],
};
/** Points of a curve are at most about so many; a screen has no more. */
const POINTS = 3000;
const HEIGHT = 150;

/** Times between which a plot shows its curves. */
type Range = readonly [from: number, to: number];

/** Columns for a plot over time: that, then one for each curve. Of very many samples those are left out between which no curve has an end or a peak. */
export function columns(samples: readonly Sample[], { curves }: Plot, range: Range = [-Infinity, Infinity]): Value[][] {
  const shown = withPeaks(samples, curves, range);
  const finite = (value: number): Value => (Number.isFinite(value) ? value : null);
  return [shown.map(({ time }) => time), ...curves.map(({ variable, element }) => shown.map((sample) => finite(valueOf(sample, variable.handle, element))))];
}

/** Points of each curve over another one. */
export function traces(samples: readonly Sample[], curves: readonly Curve[], against: Curve): [Value[], Value[]][] {
  const numbers = ({ variable, element }: Curve) => Float64Array.from(samples, (sample) => valueOf(sample, variable.handle, element));
  const abscissa = numbers(against);
  return curves.map((curve) => trace(abscissa, numbers(curve)));
}

/** At most about so many samples as a screen has points, of those between two times and one to each side: of each piece those where a curve is least and greatest. */
function withPeaks(samples: readonly Sample[], curves: readonly Curve[], [from, to]: Range): readonly Sample[] {
  const begin = Math.max(firstAfter(samples, from) - 1, 0), end = Math.min(firstAfter(samples, to) + 1, samples.length);
  const length = Math.ceil(((end - begin) * (2 * curves.length + 1)) / POINTS);
  if (length <= 2 * curves.length + 1) return samples.slice(begin, end);
  const shown: Sample[] = [];
  for (let first = begin; first < end; first += length) {
    const chosen = new Set([first]), last = Math.min(first + length, end);
    for (const curve of curves) addPeaks(samples, curve, first, last, chosen);
    for (const i of [...chosen].sort((one, other) => one - other)) shown.push(samples[i]);
  }
  if (shown[shown.length - 1] !== samples[end - 1]) shown.push(samples[end - 1]);
  return shown;
}

function addPeaks(samples: readonly Sample[], { variable, element }: Curve, first: number, last: number, chosen: Set<number>): void {
  let layout: Layout | undefined, at: number | undefined;
  let least = Infinity, greatest = -Infinity, lowest = first, highest = first;
  for (let i = first; i < last; ++i) {
    const sample = samples[i];
    if (sample.layout !== layout) [layout, at] = [sample.layout, sample.layout.offset(variable.handle)];
    const value = at === undefined ? NaN : sample.values[at + element];
    if (value < least) [least, lowest] = [value, i];
    if (value > greatest) [greatest, highest] = [value, i];
  }
  chosen.add(lowest).add(highest);
}

/** Index of the first sample after a time. */
function firstAfter(samples: readonly Sample[], time: number): number {
  let low = 0, high = samples.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (samples[middle].time <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Power of ten by which an axis counts; 0: numbers as they are, of which uPlot knows neither very large nor very small ones. */
export function powerOf(curves: readonly (readonly Value[])[]): number {
  let largest = 0;
  for (const values of curves) for (const value of values) if (value !== null) largest = Math.max(largest, Math.abs(value));
  return largest > 1e15 || (largest > 0 && largest < 1e-12) ? Math.floor(Math.log10(largest)) : 0;
}

/** Without a power of ten, which may itself be no number. */
export function without(power: number, value: number): number {
  const half = Math.trunc(power / 2);
  return value * 10 ** -half * 10 ** (half - power);
}

function scaleDown(power: number, values: Value[]): Value[] {
  return power === 0 ? values : values.map((value) => value && without(power, value));
}

function label(curve: Curve): string {
  const { variable, element } = curve;
  const part = variable.name.slice(0, variable.name.length - shortName(variable.name).length).replace(/\.$/, '');
  return `${part.replace('node.structural.', 'node ').replaceAll('.', ' ')} ${curveName(shortName(variable.name), variable.size, element)}`.trim();
}

/** Scales of a curve over another one. */
const FACETS: uPlot.Series.Facet[] = [{ scale: 'x', auto: true }, { scale: 'y', auto: true }];

/** Joins the points of a curve over another one, in the order of time. (Paths of uPlot's own go from left to right.) */
function pathOf(chart: uPlot, series: number): uPlot.Series.Paths {
  const [x, y] = chart.data[series] as unknown as [Value[], Value[]], stroke = new Path2D();
  let pen = false;
  x.forEach((abscissa, i) => {
    const ordinate = y[i];
    if (abscissa === null || ordinate === null) return void (pen = false);
    const at = [chart.valToPos(abscissa, 'x', true), chart.valToPos(ordinate, 'y', true)] as const;
    if (pen) stroke.lineTo(...at);
    else stroke.moveTo(...at);
    pen = true;
  });
  return { stroke };
}

/** Indices of points that no line shows: those beside them are not known. */
export function alone(chart: Pick<uPlot, 'data'>, series: number): number[] | null {
  const values = chart.data[series] as Value[], known = (i: number) => values[i] !== null && values[i] !== undefined;
  const found = values.flatMap((_, i) => (known(i) && !known(i - 1) && !known(i + 1) ? [i] : []));
  return found.length > 0 ? found : null;
}

class PlotView {
  readonly element: HTMLElement;
  private chart?: uPlot;
  /** Part of the time that is looked at from near by. */
  private zoomed?: Range;
  /** Of ten, by which the axes count. */
  private powers = { x: 0, y: 0 };
  private readonly whole = iconButton('fit', 'All of the time', () => this.zoom(undefined), { class: 'icon-button small hidden' });
  private readonly header = h('header');
  private readonly canvas = h('div', { class: 'canvas' });
  private readonly resized = new ResizeObserver(() => this.chart?.setSize({ width: this.width(), height: HEIGHT }));

  constructor(private readonly desk: Desk, readonly plot: Plot) {
    this.element = h('section', { class: 'plot', 'aria-label': 'Plot' }, this.header, this.canvas);
    this.resized.observe(this.canvas);
  }

  private width(): number {
    return Math.max(this.canvas.clientWidth, 120);
  }

  /** Builds the chart anew: its curves or colours changed. */
  rebuild(): void {
    this.chart?.destroy();
    const colours = COLOURS[this.desk.theme.value];
    const focused = this.header.contains(document.activeElement) ? document.activeElement?.getAttribute('aria-label') : undefined;
    const units = [...new Set(this.plot.curves.map(({ variable, element }) => unitOf(variable, element)))].filter(Boolean).join(', ');
    replace(
      this.header,
      ...this.plot.curves.map((curve, k) => this.chip(curve, colours[k % colours.length])),
      h('span', { class: 'soft' }, units && `[${units}]`),
      ...[...new Set(this.plot.curves.map(({ variable }) => variable))].filter(({ size }) => size > MOST_CURVES).map((variable) => this.chooser(variable)),
      h('span', { class: 'ends' }, this.whole, this.abscissa(), iconButton('close', 'Close this plot', () => this.desk.unplot(this.plot), { class: 'icon-button small' })),
    );
    if (focused) (this.header.querySelector<HTMLElement>(`[aria-label="${CSS.escape(focused)}"]`) ?? this.header.querySelector<HTMLElement>('.ends select'))?.focus();
    const style = getComputedStyle(document.documentElement);
    const axis: uPlot.Axis = {
      stroke: style.getPropertyValue('--soft'),
      grid: { stroke: style.getPropertyValue('--line'), width: 1 },
      ticks: { stroke: style.getPropertyValue('--line'), width: 1 },
      font: '11px system-ui',
    };
    const look = this.plot.curves.map((curve, k) => ({ label: label(curve), stroke: colours[k % colours.length], width: 1.6, points: { show: false, ...(!this.plot.against && { size: 6, filter: alone }) } }));
    this.chart = new uPlot(
      {
        width: this.width(),
        height: HEIGHT,
        padding: [null, ({ scales: { x } }) => Math.max(20, this.widthAtEnds(x.min ?? 0, x.max ?? 0) / 2), null, null],
        scales: { x: { time: false } },
        axes: [
          { ...axis, size: 26, values: this.texts('x'), space: (_, __, low, high) => Math.max(50, 20 + this.widthAtEnds(low, high)) },
          { ...axis, size: (_, labels) => Math.max(56, 20 + widthOf(labels ?? [])), values: this.texts('y') },
        ],
        hooks: { draw: [(chart) => this.drawCursor(chart)], setSelect: [(chart) => this.zoomTo(chart)] },
        ...(this.plot.against
          ? { mode: 2 as const, cursor: { show: false }, series: [{}, ...look.map((one) => ({ ...one, facets: FACETS, paths: pathOf }))] }
          : { cursor: { drag: { x: true, y: false, setScale: false }, bind: { dblclick: () => null }, points: { size: 6 } }, series: [{ sorted: 1 as const }, ...look] }),
      },
      this.data([]),
      this.canvas,
    );
    this.chart.over.addEventListener('dblclick', (event) => this.goTo(event));
    this.update();
  }

  private texts(axis: 'x' | 'y'): uPlot.Axis.DynamicValues {
    return (_, values, __, ___, increment) => ticks(values, increment, this.powers[axis]);
  }

  /** Of the texts at the ends of the abscissa. */
  private widthAtEnds(low: number, high: number): number {
    return widthOf(ticks([low, high], (high - low) / 10, this.powers.x));
  }

  /** As uPlot wants it: a table, or points for each curve where the abscissa goes to and fro. */
  private data(samples: readonly Sample[]): uPlot.AlignedData {
    const { curves, against } = this.plot;
    if (against) {
      const found = traces(samples, curves, against), x = (this.powers.x = powerOf(found.map(([x]) => x))), y = (this.powers.y = powerOf(found.map(([, y]) => y)));
      return [null, ...found.map(([xs, ys]) => [scaleDown(x, xs), scaleDown(y, ys)])] as unknown as uPlot.AlignedData;
    }
    const [time, ...values] = columns(samples, this.plot, this.zoomed);
    this.powers = { x: 0, y: powerOf(values) };
    return [time, ...values.map((column) => scaleDown(this.powers.y, column))] as uPlot.AlignedData;
  }

  private chip(curve: Curve, colour: string): HTMLElement {
    return h('span', { class: 'curve' }, h('i', { style: `background:${colour}` }), label(curve),
      iconButton('close', `Remove ${label(curve)}`, () => this.desk.unplot(this.plot, curve), { class: 'icon-button small' }));
  }

  /** Adds numbers of a variable that has many. */
  private chooser(variable: VariableInfo): HTMLElement {
    const drawn = new Set(this.plot.curves.filter((curve) => curve.variable === variable).map(({ element }) => element));
    const select = h('select', { 'aria-label': `Another number of ${variable.name}`, class: 'small' }, h('option', { value: '' }, `${drawn.size} of ${variable.size} numbers: add …`));
    for (let element = 0; element < variable.size; ++element) if (!drawn.has(element)) select.append(h('option', { value: element }, componentName(variable.size, element)));
    select.addEventListener('change', () => this.desk.addCurve(this.plot, { variable, element: Number(select.value) }));
    return select;
  }

  private abscissa(): HTMLElement {
    const choices = this.desk.plots.value.flatMap((plot) => plot.curves);
    const select = h('select', { 'aria-label': 'Plot against', class: 'small' }, h('option', { value: '' }, 'over time'));
    choices.forEach((curve, k) => select.append(h('option', { value: String(k) }, `over ${label(curve)}`)));
    select.value = String(choices.findIndex((curve) => this.plot.against && curve.variable === this.plot.against.variable && curve.element === this.plot.against.element));
    if (select.selectedIndex < 0) select.value = '';
    select.addEventListener('change', () => {
      this.plot.against = select.value === '' ? undefined : choices[Number(select.value)];
      this.desk.plots.notify();
    });
    return select;
  }

  private goTo(event: MouseEvent): void {
    if (!this.chart || this.plot.against) return;
    this.desk.cursor.value = this.chart.posToVal(event.offsetX, 'x');
  }

  private zoomTo(chart: uPlot): void {
    const { left, width } = chart.select;
    if (width === 0) return;
    chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom([chart.posToVal(left, 'x'), chart.posToVal(left + width, 'x')]);
  }

  private zoom(range: Range | undefined): void {
    this.zoomed = range;
    this.update();
  }

  private drawCursor(chart: uPlot): void {
    const sample = this.desk.sample;
    if (sample && this.plot.against) return this.drawPlace(chart, sample, this.plot.against);
    if (!sample || this.desk.cursor.value === undefined) return;
    const x = chart.valToPos(sample.time, 'x', true);
    chart.ctx.save();
    chart.ctx.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue('--accent');
    chart.ctx.lineWidth = 1.5 * devicePixelRatio;
    chart.ctx.beginPath();
    chart.ctx.moveTo(x, chart.bbox.top);
    chart.ctx.lineTo(x, chart.bbox.top + chart.bbox.height);
    chart.ctx.stroke();
    chart.ctx.restore();
  }

  /** A dot on each curve at the time looked at. */
  private drawPlace(chart: uPlot, sample: Sample, against: Curve): void {
    const x = valueOf(sample, against.variable.handle, against.element);
    chart.ctx.save();
    chart.ctx.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--accent');
    for (const { variable, element } of this.plot.curves) {
      const y = valueOf(sample, variable.handle, element);
      if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
      chart.ctx.beginPath();
      chart.ctx.arc(chart.valToPos(without(this.powers.x, x), 'x', true), chart.valToPos(without(this.powers.y, y), 'y', true), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
      chart.ctx.fill();
    }
    chart.ctx.restore();
  }

  update(): void {
    const { chart } = this, range = this.plot.against ? undefined : this.zoomed, data = this.data(this.desk.shown.value?.recording.samples ?? []);
    this.whole.classList.toggle('hidden', range === undefined);
    chart?.batch(() => {
      chart.setData(data, range === undefined);
      if (range) chart.setScale('x', { min: range[0], max: range[1] });
    });
  }

  end(): void {
    this.resized.disconnect();
    this.chart?.destroy();
  }
}

/** Of the widest of some texts at an axis, about. */
function widthOf(labels: readonly string[]): number {
  return 7 * Math.max(...labels.map((text) => text.length), 0);
}

export function plotsPanel(desk: Desk): HTMLElement {
  const element = h('div', { class: 'plots' });
  let views: PlotView[] = [];
  const rebuild = () => {
    const before = views;
    views = desk.plots.value.map((plot) => before.find((view) => view.plot === plot) ?? new PlotView(desk, plot));
    before.filter((view) => !views.includes(view)).forEach((view) => view.end());
    arrange(element, views.map((view) => view.element));
    views.forEach((view) => view.rebuild());
  };
  desk.plots.watch(rebuild);
  desk.theme.watch(() => views.forEach((view) => view.rebuild()));
  desk.calm.watch(() => views.forEach((view) => view.update()));
  return element;
}
