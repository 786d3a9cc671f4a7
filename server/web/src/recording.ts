/** What the page has seen of a simulation: samples in the order of time, within a budget of memory. */

/** Where the numbers of each variable stand in a sample. */
export class Layout {
  readonly handles: readonly number[];
  readonly width: number;
  private readonly offsets = new Map<number, number>();

  constructor(variables: Iterable<{ handle: number; size: number }>) {
    const handles: number[] = [];
    let width = 0;
    for (const { handle, size } of variables) {
      if (this.offsets.has(handle)) continue;
      handles.push(handle);
      this.offsets.set(handle, width);
      width += size;
    }
    this.handles = handles;
    this.width = width;
  }

  offset(handle: number): number | undefined {
    return this.offsets.get(handle);
  }
}

export interface Sample {
  readonly step: number;
  readonly time: number;
  readonly layout: Layout;
  readonly values: Float64Array;
}

/** One number of a variable in a sample; NaN: the sample does not have it. */
export function valueOf(sample: Sample, handle: number, element = 0): number {
  const at = sample.layout.offset(handle);
  return at === undefined ? NaN : sample.values[at + element];
}

export class Recording {
  readonly samples: Sample[] = [];
  private bytes = 0;
  /** One in so many samples is kept; the newest always is, for the time being. */
  private stride = 1;
  private count = 0;

  constructor(private readonly budget = 128 * 1024 * 1024) {}

  get last(): Sample | undefined {
    return this.samples[this.samples.length - 1];
  }

  /** Adds a sample. One at an earlier step rewrites history: what came after it goes. */
  push(sample: Sample): void {
    if (this.last && this.last.step >= sample.step) {
      while (this.last && this.last.step >= sample.step) this.drop();
      this.count = 0;
    }
    if (this.count % this.stride !== 0) this.drop();
    this.samples.push(sample);
    this.bytes += sizeOf(sample);
    this.count += 1;
    if (this.bytes > this.budget) this.thinOut();
  }

  /** Adds a sample that may come late; one at a step that is there already takes its place. */
  insert(sample: Sample): void {
    if (!this.last || sample.step > this.last.step) return this.push(sample);
    let at = this.samples.length - 1;
    while (at >= 0 && this.samples[at].step > sample.step) --at;
    if (at >= 0 && this.samples[at].step === sample.step) {
      this.bytes += sizeOf(sample) - sizeOf(this.samples[at]);
      this.samples[at] = sample;
    } else if (this.stride === 1) {
      this.samples.splice(at + 1, 0, sample);
      this.bytes += sizeOf(sample);
    }
  }

  clear(): void {
    this.samples.length = 0;
    this.bytes = 0;
    this.stride = 1;
    this.count = 0;
  }

  /** Index of the last sample at or before `time`; 0 when all are later; −1: there is none. */
  indexAt(time: number): number {
    let low = 0, high = this.samples.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.samples[middle].time <= time) low = middle;
      else high = middle - 1;
    }
    return high < 0 ? -1 : low;
  }

  private drop(): void {
    const gone = this.samples.pop();
    if (gone) this.bytes -= sizeOf(gone);
  }

  private thinOut(): void {
    const { samples } = this;
    for (let i = 0; 2 * i < samples.length; ++i) samples[i] = samples[2 * i];
    samples.length = Math.ceil(samples.length / 2);
    this.bytes = samples.reduce((sum, sample) => sum + sizeOf(sample), 0);
    this.stride *= 2;
    this.count = 0;
  }
}

/** What browsers need besides the numbers, for the sample and its array. */
const OVERHEAD = 240;

function sizeOf(sample: Sample): number {
  return sample.values.byteLength + OVERHEAD;
}
