/** What the solver did: iterations, residuals, where the time went. */
import uPlot from 'uplot';
import type { Desk } from '../desk';
import { h, oncePerFrame } from '../dom';
import { number, seconds, ticks } from '../format';
import type { StepRecord } from '../session';
import { section } from './section';

const PARTS = [
  { name: 'solver', colour: '#4aa8ff', of: (step: StepRecord) => step.solver },
  { name: 'peers', colour: '#f0a13c', of: (step: StepRecord) => step.peers },
  { name: 'rest', colour: '#8795a3', of: (step: StepRecord) => Math.max(step.total - step.solver - step.peers, 0) },
  { name: 'wire', colour: '#35c2a8', of: (step: StepRecord) => Math.max(step.elapsed - step.total, 0) },
];

/** Parts of the wall time of the last calls; they sum to 1 unless nothing was spent. */
export function timeSplit(steps: readonly StepRecord[]): number[] {
  const sums = PARTS.map((part) => steps.reduce((sum, step) => sum + part.of(step), 0));
  const total = sums.reduce((sum, part) => sum + part, 0);
  return sums.map((sum) => (total > 0 ? sum / total : 0));
}

export function solverPanel(desk: Desk): HTMLElement {
  const facts = h('tbody');
  const bar = h('div', { class: 'bar', role: 'img' });
  const times = PARTS.map(() => h('span'));
  const legend = h('div', { class: 'legend' }, ...PARTS.map((part, k) => h('span', {}, h('i', { style: `background:${part.colour}` }), part.name, ' ', times[k])));
  const canvas = h('div', { style: 'height:130px' });
  const panel = section('Solver', true, h('table', { class: 'values' }, facts), bar, legend, h('div', { class: 'legend' }, h('span', { style: 'color:var(--chart-1)' }, 'iterations'), h('span', { class: 'spacer' }), h('span', { style: 'color:var(--chart-2)' }, 'residual')), canvas);
  let chart: uPlot | undefined;
  let unwatch = () => {};

  const draw = () => {
    const steps: readonly StepRecord[] = desk.session?.steps.value ?? [];
    const last = steps[steps.length - 1], recent = steps.slice(-50);
    const count = recent.reduce((sum, step) => sum + step.steps, 0), solver = recent.reduce((sum, step) => sum + step.solver, 0);
    const rows: [string, string][] = last
      ? [['iterations in the last step', String(last.iterations)], ['residual', number(last.residual, 3)], ['solver time a step', seconds(count > 0 ? solver / count : 0)]]
      : [['no step from this page yet', '']];
    facts.replaceChildren(...rows.map(([name, text]) => h('tr', {}, h('th', { scope: 'row' }, name), h('td', {}, text))));
    PARTS.forEach((part, k) => (times[k].textContent = count > 0 ? seconds(recent.reduce((sum, step) => sum + part.of(step), 0) / count) : ''));
    const split = timeSplit(recent);
    bar.replaceChildren(...split.map((part, k) => h('span', { style: `width:${100 * part}%;background:${PARTS[k].colour}` })));
    bar.setAttribute('aria-label', PARTS.map((part, k) => `${part.name} ${Math.round(100 * split[k])} %`).join(', '));
    chart?.setData([steps.map((step) => step.time), steps.map((step) => step.iterations), steps.map((step) => (step.residual > 0 ? Math.log10(step.residual) : null))]);
  };

  const rebuild = () => {
    chart?.destroy();
    const style = getComputedStyle(document.documentElement), line = style.getPropertyValue('--line'), soft = style.getPropertyValue('--soft');
    const axis: uPlot.Axis = { stroke: soft, grid: { stroke: line }, ticks: { stroke: line }, font: '10px system-ui' };
    chart = new uPlot(
      {
        width: Math.max(canvas.clientWidth, 200),
        height: 130,
        scales: { x: { time: false }, y: { range: (_, low, high) => [Math.min(low ?? 0, 0), Math.max(high ?? 1, 1) + 1] }, log: { range: (_, low, high) => [Math.floor(low ?? -12), Math.ceil(high ?? -6)] } },
        axes: [{ ...axis, size: 30, values: (_, values, __, ___, increment) => ticks(values, increment) }, { ...axis, stroke: PARTS[0].colour, size: 28, incrs: [1, 2, 5, 10, 20, 50, 100] }, { ...axis, stroke: PARTS[1].colour, size: 48, side: 1, scale: 'log', grid: { show: false }, values: (_, ticks) => ticks.map((tick) => (Number.isInteger(tick) ? `1e${tick}` : '')) }],
        series: [{}, { label: 'iterations', stroke: PARTS[0].colour, width: 1.4 }, { label: 'residual', stroke: PARTS[1].colour, scale: 'log', width: 1.2 }],
        cursor: { show: false },
      },
      [[], [], []],
      canvas,
    );
    draw();
  };

  const drawSoon = oncePerFrame(draw);
  desk.theme.watch(rebuild);
  desk.shown.watch(() => {
    unwatch();
    panel.classList.toggle('hidden', !desk.session);
    unwatch = desk.session?.steps.watch(drawSoon) ?? (() => {});
  });
  new ResizeObserver(() => chart?.setSize({ width: Math.max(canvas.clientWidth, 200), height: 130 })).observe(canvas);
  return panel;
}
