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

/** Name of a file with what is shown under a title. */
export function fileName(title: string, ending: string): string {
  return `${title.replace(/[^\p{L}\p{N}_.-]+/gu, '_')}.${ending}`;
}

/** What a recording holds, as JSON. Numbers of samples are in base64, and no less exact than they were: tables are made of them. */
interface Stored {
  format: 'mbcosim-recording-1';
  title: string;
  model: Model;
  geometry: Geometry;
  layout: { handle: number; size: number }[];
  steps: number[];
  times: number[];
  values: Float64Array;
}

/** Of so many bytes of numbers browsers can make a text. Of more samples some are left out. */
const MOST_BYTES = 128 * 1024 * 1024;

/** JSON has no infinity, and no compact form of many numbers. */
function forJson(value: unknown): unknown {
  if (value instanceof Float32Array) return { float32: base64(value) };
  if (value instanceof Float64Array) return { float64: base64(value) };
  return value === Infinity ? { infinite: true } : value;
}

function fromJson(value: unknown): unknown {
  const { float32, float64, infinite } = (value ?? {}) as { float32?: unknown; float64?: unknown; infinite?: unknown };
  if (typeof float32 === 'string') return new Float32Array(bytesOf(float32).buffer);
  if (typeof float64 === 'string') return new Float64Array(bytesOf(float64).buffer);
  return infinite === true ? Infinity : value;
}

export function store(shown: Shown, most = MOST_BYTES): string {
  const all = shown.recording.samples;
  const handles = new Map<number, number>();
  const sizes = new Map(shown.model.variables.map((variable) => [variable.handle, variable.size]));
  for (const sample of all) for (const handle of sample.layout.handles) handles.set(handle, sizes.get(handle) ?? 1);
  const layout = new Layout([...handles].map(([handle, size]) => ({ handle, size })));
  const stride = Math.ceil((layout.width * all.length * Float64Array.BYTES_PER_ELEMENT) / most) || 1;
  const samples = all.filter((_, i) => i % stride === 0 || i === all.length - 1);
  const values = new Float64Array(layout.width * samples.length).fill(NaN);
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
  const recording = new Recording(Infinity);
  stored.times.forEach((time, i) =>
    recording.push({ step: stored.steps[i], time, layout, values: stored.values.subarray(i * layout.width, (i + 1) * layout.width) }));
  return { title: stored.title, model: stored.model, geometry: stored.geometry, recording, changed: new Signal(0) };
}

/** This very page with a recording inside. */
export function recordingPage(page: string, shown: Shown): string {
  const place = '<!-- recording -->';
  if (!page.includes(place)) throw new Error('the page has no place for a recording');
  return page.replace(place, () => `<script type="application/json" id="recording">${store(shown)}</script>`);
}

function base64({ buffer, byteOffset, byteLength }: ArrayBufferView): string {
  const bytes = new Uint8Array(buffer, byteOffset, byteLength);
  let text = '';
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  return btoa(text);
}

function bytesOf(text: string): Uint8Array {
  const characters = atob(text), bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes;
}
