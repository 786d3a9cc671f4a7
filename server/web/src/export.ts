/** What can be taken away: a table, a picture, a recording that opens without a daemon. */
import type { Curve, Plot } from './desk';
import { shortName, type Model } from './model';
import type { Geometry } from './geometry';
import { Layout, Recording, valueOf, type Sample } from './recording';
import type { Shown } from './session';
import { Signal } from './signal';
import { curveName, unitOf } from './format';

/** Samples as a table: time, then all curves of the plots, with names and units in the first line. */
export function csv(samples: readonly Sample[], plots: readonly Plot[]): string {
  const curves: Curve[] = plots.flatMap((plot) => plot.curves);
  const head = ['step', 'time [s]', ...curves.map(({ variable, element }) => {
    const owner = variable.name.slice(0, variable.name.length - shortName(variable.name).length);
    return `${owner}${curveName(shortName(variable.name), variable.size, element)}${variable.unit ? ` [${unitOf(variable, element)}]` : ''}`;
  })];
  const quoted = head.map((name) => (/[",\n]/.test(name) ? `"${name.replaceAll('"', '""')}"` : name));
  const rows = samples.map((sample) => [sample.step, sample.time, ...curves.map(({ variable, element }) => valueOf(sample, variable.handle, element))].map((value) => (Number.isNaN(value) ? '' : String(value))).join(','));
  return [quoted.join(','), ...rows].join('\n') + '\n';
}

/** What a recording holds, as JSON. Numbers of samples are 32-bit floats in base64: pictures need no more. */
interface Stored {
  format: 'mbcosim-recording-1';
  title: string;
  model: Model;
  geometry: Geometry;
  layout: { handle: number; size: number }[];
  steps: number[];
  times: number[];
  values: Float32Array;
}

/** JSON has no infinity, and no compact form of many numbers. */
const INFINITE = '∞';

function forJson(value: unknown): unknown {
  if (value instanceof Float32Array) return { float32: base64(new Uint8Array(value.buffer, value.byteOffset, value.byteLength)) };
  return value === Infinity ? INFINITE : value;
}

function fromJson(value: unknown): unknown {
  const packed = (value as { float32?: unknown } | null)?.float32;
  if (typeof packed === 'string') return new Float32Array(bytesOf(packed).buffer);
  return value === INFINITE ? Infinity : value;
}

export function store(shown: Shown): string {
  const samples = shown.recording.samples;
  const handles = new Map<number, number>();
  const sizes = new Map(shown.model.variables.map((variable) => [variable.handle, variable.size]));
  for (const sample of samples) for (const handle of sample.layout.handles) handles.set(handle, sizes.get(handle) ?? 1);
  const layout = new Layout([...handles].map(([handle, size]) => ({ handle, size })));
  const values = new Float32Array(layout.width * samples.length).fill(NaN);
  samples.forEach((sample, i) => {
    for (const [handle, size] of handles) {
      const from = sample.layout.offset(handle), to = layout.offset(handle);
      if (from !== undefined && to !== undefined) values.set(sample.values.subarray(from, from + size), i * layout.width + to);
    }
  });
  const stored: Stored = {
    format: 'mbcosim-recording-1',
    title: shown.title,
    model: { ...shown.model, variables: shown.model.variables.filter((variable) => handles.has(variable.handle)) },
    geometry: shown.geometry,
    layout: [...handles].map(([handle, size]) => ({ handle, size })),
    steps: samples.map((sample) => sample.step),
    times: samples.map((sample) => sample.time),
    values,
  };
  return JSON.stringify(stored, (_, value) => forJson(value)).replaceAll('<', '\\u003c');
}

export function unstore(text: string): Shown {
  const stored = JSON.parse(text, (_, value) => fromJson(value)) as Stored;
  if (stored.format !== 'mbcosim-recording-1') throw new Error('this is no recording of mbcosim');
  const layout = new Layout(stored.layout);
  const values = Float64Array.from(stored.values);
  const recording = new Recording(Infinity);
  stored.times.forEach((time, i) =>
    recording.push({ step: stored.steps[i], time, layout, values: values.slice(i * layout.width, (i + 1) * layout.width) }));
  return { title: stored.title, model: stored.model, geometry: stored.geometry, recording, changed: new Signal(0) };
}

/** This very page with a recording inside. */
export function recordingPage(page: string, shown: Shown): string {
  const place = '<!-- recording -->';
  if (!page.includes(place)) throw new Error('the page has no place for a recording');
  return page.replace(place, () => `<script type="application/json" id="recording">${store(shown)}</script>`);
}

function base64(bytes: Uint8Array): string {
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text);
}

function bytesOf(text: string): Uint8Array {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
}
