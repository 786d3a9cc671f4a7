/** A simulation on the screen: what is known of it, what was seen of it, and what can be done with it. */
import { timestampDate } from '@bufbuild/protobuf/wkt';
import { events, failureOf, remedy, simulations, telemetry, type Failure } from './api';
import { describe, eigenvectors, look, stateNames, told } from './questions';
import { tell } from './events';
import { duration } from './duration';
import type { Diagnostic } from './gen/mbcosim/v1/common_pb';
import { SimulationState, StepOutcome, type SimulationInfo, type Snapshot, type StepReply } from './gen/mbcosim/v1/simulations_pb';
import { OverflowPolicy, type SubscribeReply } from './gen/mbcosim/v1/telemetry_pb';
import type { Geometry } from './geometry';
import { loadGeometry } from './load_geometry';
import { modelOf, type Model, type VariableInfo } from './model';
import { modesOf, type Mode } from './modes';
import { Pace } from './pace';
import { pause, placeToFollow, takePlace, type Place } from './places';
import { Layout, Recording, type Sample } from './recording';
import { newRequestId } from './requests';
import { Signal } from './signal';

/** What the panels and the scene show: a running simulation, or one out of a file. */
export interface Shown {
  readonly title: string;
  readonly model: Model;
  readonly geometry: Geometry;
  readonly recording: Recording;
  /** Told when samples came or went. */
  readonly changed: Signal<number>;
}

export interface StepRecord {
  step: number;
  time: number;
  iterations: number;
  residual: number;
  solver: number;
  peers: number;
  /** On the server; `elapsed`: until the page had the reply. */
  total: number;
  elapsed: number;
  steps: number;
}

export interface LogEntry {
  wall: Date;
  text: string;
  level: 'info' | 'error';
}

/** Samples a second of wall time are at most so many, and at most so many bytes. */
const RATE = 120, BYTES = 8e6;
const RETRY_MILLISECONDS = 1500;
/** For events that are there already. */
const LOOK_MILLISECONDS = 500;
/** The server has so long to end the step that is under way when a run is left. */
const LEAVING_MILLISECONDS = 10_000;

/** `until`: up to a time that was asked for. */
export type Playing = 'no' | 'paced' | 'fast' | 'until';

export class Session implements Shown {
  readonly recording = new Recording();
  readonly changed = new Signal(0);
  readonly info: Signal<SimulationInfo>;
  readonly playing = new Signal<Playing>('no');
  readonly speed = new Signal(1);
  readonly snapshots = new Signal<Snapshot[]>([]);
  readonly steps = new Signal<StepRecord[]>([]);
  readonly log = new Signal<LogEntry[]>([]);
  readonly failure = new Signal<Failure | undefined>(undefined);
  /** Warnings and notes of its deck, until they are read. */
  readonly findings = new Signal<Diagnostic[]>([]);
  /** Why nothing can be asked of the daemon at the moment; empty: it answers. */
  readonly lost = new Signal('');
  /** The daemon answers and does not know the simulation any more. */
  readonly gone = new Signal(false);

  private layout: Layout;
  private readonly base: VariableInfo[] = [];
  private readonly wanted = new Map<number, VariableInfo>();
  private readonly ended = new AbortController();
  private stream = new AbortController();
  private eventStream = new AbortController();
  /** The last event. */
  private readonly seen = { journal: '', afterSequence: 0n };
  /** Whether samples come by a stream. Otherwise they are read now and then. */
  private following = false;
  private fast = new AbortController();
  /** Step whose values were refused: they are not asked for again and again. */
  private unreadable = -1;
  /** Step of the last sample of the stream. */
  private streamed = -1;
  /** While a call advances, or what it came to is read. */
  busy = false;
  /** Number of what was wished for last: a run, steps, a pause. */
  private wish = 0;
  /** Ends with the last call that advances. */
  private driven: Promise<void> = Promise.resolve();
  /** Steps that are asked for and not begun. */
  private owed = 0;
  /** What waits for the end of a call that advances. */
  private readonly waiting: (() => Promise<void>)[] = [];
  /** Newest values that wait to be written, by handle. */
  private readonly unwritten = new Map<number, number[]>();
  private snapshotsChanged = false;
  private snapshotsRead?: Promise<void>;
  /** When a run was left last. */
  private left = -Infinity;

  private constructor(info: SimulationInfo, readonly model: Model, readonly geometry: Geometry) {
    this.info = new Signal(info);
    const byHandle = new Map(model.variables.map((variable) => [variable.handle, variable]));
    const follow = (handle: number | undefined) => {
      const variable = handle === undefined ? undefined : byHandle.get(handle);
      if (variable) this.base.push(variable);
    };
    for (const node of geometry.nodes) follow(node.positionHandle), follow(node.orientationHandle);
    for (const element of geometry.elements) {
      for (const arrow of element.arrows) follow(arrow.handle);
      for (const line of element.lines) follow(line.value);
    }
    for (const body of geometry.bodies) body.amplitudes.forEach(follow);
    this.layout = new Layout(this.base);
  }

  /** Reads all about the simulation `name` and follows it until `close`. */
  static async open(name: string): Promise<Session> {
    const [info, description, { geometry, cards, fault }] = await Promise.all([look(name), describe(name), loadGeometry(name)]);
    const session = new Session(info, modelOf(description, cards), geometry);
    await session.read();
    if (fault) session.tell({ message: fault, reason: '', metadata: {}, diagnostics: [], cancelled: false });
    void session.follow();
    void session.poll();
    void session.watch();
    void session.refreshSnapshots();
    return session;
  }

  get name(): string {
    return this.info.value.name;
  }

  get title(): string {
    return this.info.value.displayName || this.model.title || this.name;
  }

  close(): void {
    this.pause();
    this.ended.abort();
    this.stream.abort();
    this.eventStream.abort();
  }

  // ---- what is seen

  /** Variables that plots and panels need besides those of the scene. */
  want(variables: readonly VariableInfo[]): void {
    const missing = variables.filter((variable) => this.layout.offset(variable.handle) === undefined);
    for (const variable of variables) this.wanted.set(variable.handle, variable);
    if (missing.length === 0) return;
    this.layout = new Layout([...this.base, ...this.wanted.values()]);
    this.stream.abort();  // subscribes anew
    void this.read();
  }

  /** Takes the values at the last accepted step into the recording. `undone`: see `take`. */
  private async read(undone = () => false): Promise<void> {
    const layout = this.layout;
    try {
      const reply = await simulations.readVariables({ simulation: this.name, handles: [...layout.handles] });
      this.take({ step: Number(reply.step), time: reply.time, layout, values: Float64Array.from(reply.values) }, undone());
    } catch (thrown) {
      const failure = failureOf(thrown);
      if (!failure.passing) this.unreadable = Number(this.info.value.step);
      this.tell(failure);
    }
  }

  /** `undone`: the simulation went back to this sample's step; otherwise it may come late, and takes its place. */
  private take(sample: Sample, undone: boolean): void {
    if (undone) this.recording.push(sample);
    else this.recording.insert(sample);
    this.changed.value += 1;
  }

  private async follow(): Promise<void> {
    for (;;) {
      const place = await placeToFollow('samples', () => !this.ended.signal.aborted, () => this.stream.abort());
      if (!place) return;
      this.stream = new AbortController();
      this.streamed = -1;
      this.following = true;
      const layout = this.layout;
      try {
        if (this.ended.signal.aborted) return;  // in the moment in which it got the place
        const batches = telemetry.subscribe(
          { simulation: this.name, handles: [...layout.handles], minimumInterval: duration(shortestInterval(layout)), policy: OverflowPolicy.DROP_OLDEST, bufferSamples: 64 },
          { signal: this.stream.signal },
        );
        for await (const batch of batches) this.takeBatch(batch, layout);
        return;  // the simulation is deleted
      } catch (thrown) {
        if (this.ended.signal.aborted) return;
      } finally {
        this.following = false;
        place.release();
      }
      if (!this.stream.signal.aborted) await pause(RETRY_MILLISECONDS);
    }
  }

  /** Follows what happens to the simulation, whoever makes it happen; begins with what the server knows of before. */
  private async watch(): Promise<void> {
    const wanted = () => !this.ended.signal.aborted;
    const lookNowAndThen = async () => {
      await this.readEvents(AbortSignal.timeout(LOOK_MILLISECONDS)).catch(() => {});
      await pause(RETRY_MILLISECONDS);
    };
    for (;;) {
      const place = await placeToFollow('events', wanted, () => this.eventStream.abort(), lookNowAndThen);
      if (!place) return;
      this.eventStream = new AbortController();
      try {
        if (this.ended.signal.aborted) return;
        await this.readEvents(this.eventStream.signal);
        return;  // the simulation is deleted
      } catch {
        if (this.ended.signal.aborted) return;
      } finally {
        place.release();
      }
      if (!this.eventStream.signal.aborted) await pause(RETRY_MILLISECONDS);
    }
  }

  private async readEvents(signal: AbortSignal): Promise<void> {
    const { journal, afterSequence } = this.seen;
    for await (const event of events.watchEvents({ simulation: this.name, journal, afterSequence }, { signal })) {
      if (event.content.case === 'started') this.seen.journal = event.content.value.journal;
      else if (event.content.case === 'snapshot') void this.refreshSnapshots();
      const told = event.content.case === 'missed' && this.seen.afterSequence === 0n ? undefined : tell(event);
      if (told) this.note(told.text, told.level, event.time && timestampDate(event.time));
      this.seen.afterSequence = event.sequence ?? this.seen.afterSequence;
    }
  }

  private takeBatch(batch: SubscribeReply, layout: Layout): void {
    this.lost.value = '';
    for (const sample of batch.samples) {
      const step = Number(sample.step);
      // Samples of a stream come in order, unless somebody restored a state.
      this.take({ step, time: sample.time, layout, values: Float64Array.from(sample.values) }, step <= this.streamed);
      this.streamed = step;
    }
  }

  /** Keeps state, waits and connection up to date, whoever drives the simulation. */
  private async poll(): Promise<void> {
    while (!this.ended.signal.aborted) {
      await pause(this.playing.value === 'no' ? 1000 : 400);
      try {
        const last = this.recording.last, still = () => last !== undefined && last === this.recording.last;
        await this.refresh();
        const undone = still() && Number(this.info.value.step) < Number(last?.step);  // somebody else restored a state
        if (undone || this.lost.value || this.behind()) await this.read(() => undone && still());
        this.lost.value = '';
        if (this.failure.value?.passing) this.failure.value = undefined;
      } catch (thrown) {
        const failure = failureOf(thrown);
        if (failure.cancelled) continue;
        this.lost.value = failure.reason ? `${failure.message}. ${remedy(failure)}` : 'The daemon does not answer; trying again.';
        if (failure.reason === 'NO_SUCH_SIMULATION') {
          this.gone.value = true;
          this.note('the simulation is gone', 'error');
          this.close();
        }
      }
    }
  }

  private async refresh(): Promise<void> {
    this.info.value = await look(this.name, { timeoutMs: 5000, signal: this.ended.signal });
  }

  /** Whether the simulation is at a step that no stream will bring: streams leave some out. */
  private behind(): boolean {
    const { state, step } = this.info.value;
    const rests = state !== SimulationState.STEPPING && this.playing.value === 'no';
    return (rests || !this.following) && Number(step) !== this.recording.last?.step && Number(step) !== this.unreadable;
  }

  // ---- what is done

  /**
   * Begins what was wished for last when the call that advances, if there is one, has ended. `wanted` tells whether nothing else was
   * wished for since then.
   */
  private drive(work: (wanted: () => boolean) => Promise<void>): Promise<void> {
    const wish = ++this.wish;
    const wanted = () => this.wish === wish;
    return this.queue(async () => {
      if (!wanted()) return;
      try {
        await work(wanted);
      } catch (thrown) {
        if (wanted()) this.pause();
        throw thrown;
      }
    });
  }

  /** Does it when the call that advances, if there is one, has ended. */
  private queue(work: () => Promise<void>): Promise<void> {
    this.driven = this.driven.then(async () => {
      this.busy = true;
      await this.attempt(work);
      this.busy = false;
    });
    return this.driven;
  }

  /** Asks again, for a while, what is refused because the server still ends a run that was left. */
  private async patiently<T>(ask: () => Promise<T>): Promise<T> {
    for (;;) {
      try {
        return await ask();
      } catch (thrown) {
        if (failureOf(thrown).reason !== 'SIMULATION_BUSY' || performance.now() > this.left + LEAVING_MILLISECONDS) throw thrown;
      }
      await pause(20);
    }
  }

  /** Ends a run. Steps that are asked for while another call advances are taken after it. */
  async step(steps: number): Promise<void> {
    const waiting = this.owed > 0;
    this.failure.value = undefined;
    if (this.playing.value !== 'no') this.pause();
    this.owed += steps;
    if (waiting) return;
    await this.drive(async (wanted) => {
      for (; this.owed > 0 && wanted(); await this.doWaiting()) {
        const count = this.owed;
        this.owed = 0;
        await this.advance({ case: 'steps', value: BigInt(count) }, wanted);
      }
    });
  }

  /** Without regard to the wall clock, unless it is paused before. */
  runUntil(time: number): Promise<void> {
    return this.playFast('until', time);
  }

  private playFast(playing: Playing, end: number): Promise<void> {
    this.failure.value = undefined;
    this.pause();
    this.playing.value = playing;
    return this.drive((wanted) => this.run(end, wanted));
  }

  private async advance(how: { case: 'steps'; value: bigint } | { case: 'untilTime'; value: number }, wanted: () => boolean): Promise<void> {
    try {
      const begun = performance.now();
      this.done(await this.patiently(() => simulations.step({ simulation: this.name, advance: how })), begun, wanted);
      if (this.playing.value === 'no' || !this.following) await this.read();  // telemetry need not have this step
    } catch (thrown) {
      this.tell(failureOf(thrown));
      if (wanted()) this.pause();
    }
  }

  play(): void {
    if (this.playing.value !== 'no') return;
    this.failure.value = undefined;
    if (!Number.isFinite(this.speed.value)) return void this.playFast('fast', Number.isFinite(this.model.finalTime) ? this.model.finalTime : Number.MAX_VALUE);
    this.pause();
    this.playing.value = 'paced';
    void this.drive((wanted) => this.pace(wanted));
  }

  pause(): void {
    this.wish += 1;
    this.owed = 0;
    this.fast.abort();
    this.playing.value = 'no';
  }

  setSpeed(speed: number): void {
    this.speed.value = speed;
    if (this.playing.value === 'no' || this.playing.value === 'until') return;
    this.pause();
    this.play();
  }

  private async pace(wanted: () => boolean): Promise<void> {
    await this.refresh();  // others, and a run that was left, may have gone on since
    const pace = new Pace(this.speed.value, performance.now() / 1000, this.info.value.time);
    for (let rested = 0; wanted(); await this.doWaiting()) {
      const info = this.info.value, now = performance.now() / 1000;
      const target = pace.next(now, info.time, info.nextStepSize || this.model.step, document.hidden && rested ? now - rested : 0);
      rested = target === undefined ? now : 0;
      if (target === undefined) await pause(8);
      else await this.advance({ case: 'untilTime', value: target }, wanted);
      if (wanted() && this.info.value.state === SimulationState.FINISHED) this.pause();
    }
  }

  private async run(end: number, wanted: () => boolean): Promise<void> {
    const place = await this.placeToRun(wanted);
    if (!place) return;
    try {
      await this.runOn(end, wanted);
    } finally {
      place.release();
    }
  }

  private async placeToRun(wanted: () => boolean): Promise<Place | undefined> {
    for (let told = false; wanted(); await pause(200)) {
      const place = await takePlace('run');
      if (place) return place;
      if (!told) this.note('waits until a run in another tab ends');
      told = true;
      await this.doWaiting();
    }
    return undefined;
  }

  /** A run that is left for values to be written goes on. */
  private async runOn(end: number, wanted: () => boolean): Promise<void> {
    for (let over = false; wanted() && !over; ) {
      this.fast = new AbortController();
      await this.doWaiting();
      try {
        over = await this.patiently(() => this.runPiece(end, wanted, this.fast.signal));
      } catch (thrown) {
        if (!this.fast.signal.aborted) throw thrown;
        await this.leave();
      }
    }
    if (wanted()) this.pause();
    await this.read();
  }

  private async runPiece(end: number, wanted: () => boolean, signal: AbortSignal): Promise<boolean> {
    const begun = performance.now();
    const run = simulations.run({ step: { simulation: this.name, advance: { case: 'untilTime', value: end } }, progressInterval: duration(0.2) }, { signal });
    for await (const reply of run) if (reply.content.case === 'done') this.done(reply.content.value, begun, wanted);
    return true;
  }

  /** Waits, not for ever, until the server has ended the step that is under way in a run that was left. */
  private async leave(): Promise<void> {
    this.left = performance.now();
    for (;;) {
      await this.refresh();
      if (this.info.value.state !== SimulationState.STEPPING || performance.now() > this.left + LEAVING_MILLISECONDS) return;
      await pause(20);
    }
  }

  /** `begun`: when the page asked, in milliseconds. */
  private done(reply: StepReply, begun: number, wanted: () => boolean): void {
    const state = reply.outcome === StepOutcome.FINISHED ? SimulationState.FINISHED : SimulationState.READY;
    this.info.value = { ...this.info.value, state, step: reply.step, time: reply.time };
    if (reply.stepsDone > 0n) this.keep(reply, (performance.now() - begun) / 1000);
    if (reply.outcome === StepOutcome.ACCEPTED || reply.outcome === StepOutcome.INTERRUPTED) return;
    if (wanted()) this.pause();
    if (reply.outcome === StepOutcome.FINISHED) return;
    this.failure.value = {
      message: reply.failure?.message ?? 'the step failed',
      reason: StepOutcome[reply.outcome],
      metadata: {},
      diagnostics: [],
      solver: reply.failure,
      cancelled: false,
    };
  }

  private keep(reply: StepReply, elapsed: number): void {
    const steps = this.steps.value.slice(-499).filter((before) => before.step < Number(reply.step));  // later ones are undone
    steps.push({
      step: Number(reply.step),
      time: reply.time,
      iterations: reply.iterations,
      residual: reply.residualError,
      solver: reply.solverSeconds,
      peers: reply.peerWaitSeconds,
      total: reply.totalSeconds,
      elapsed,
      steps: Number(reply.stepsDone),
    });
    this.steps.value = steps;
  }

  /** Between two calls of the page's that advance; a run without regard to the wall clock is left for that. Ends when it is done. */
  private between(work: () => Promise<void>): Promise<void> {
    return new Promise((done) => {
      this.waiting.push(() => this.attempt(work).then(done));
      this.fast.abort();
      void this.queue(() => this.doWaiting());
    });
  }

  private async doWaiting(): Promise<void> {
    for (let work = this.waiting.shift(); work; work = this.waiting.shift()) await work();
  }

  /** Ends when these values, or newer ones, are written. */
  write({ handle }: VariableInfo, values: number[]): Promise<void> {
    this.unwritten.set(handle, values);
    return this.between(async () => {
      const newest = this.unwritten.get(handle);
      if (!newest) return;
      this.unwritten.delete(handle);
      await this.patiently(() => simulations.writeVariables({ simulation: this.name, values: { handles: [handle], values: newest } }));
      await this.read();
    });
  }

  async saveSnapshot(displayName: string): Promise<void> {
    await this.attempt(async () => {
      await simulations.createSnapshot({ simulation: this.name, displayName });
    });
    await this.refreshSnapshots();
  }

  restore(snapshot: Snapshot): Promise<void> {
    return this.goBack(() => simulations.restoreSnapshot({ simulation: this.name, snapshot: snapshot.name }));
  }

  /** To the initial solution. */
  reset(): Promise<void> {
    return this.goBack(() => simulations.resetSimulation({ simulation: this.name }));
  }

  private async goBack(ask: () => Promise<{ simulation?: SimulationInfo }>): Promise<void> {
    this.pause();
    await this.queue(async () => {
      this.info.value = told((await this.patiently(ask)).simulation);
      this.failure.value = undefined;
      this.stream.abort();  // what is still on its way is of a time undone
      await this.read(() => true);
    });
  }

  /** Name of a new simulation that starts at the snapshot, or at the present state. */
  async branch(snapshot: Snapshot | undefined, displayName: string): Promise<string | undefined> {
    let name: string | undefined;
    await this.attempt(async () => {
      const reply = await simulations.forkSimulation({ simulation: this.name, snapshot: snapshot?.name, options: { displayName, requestId: newRequestId() } });
      name = reply.simulation?.name;
    });
    return name;
  }

  async deleteSnapshot(snapshot: Snapshot): Promise<void> {
    await this.attempt(async () => void (await simulations.deleteSnapshot({ simulation: this.name, snapshot: snapshot.name })));
    await this.refreshSnapshots();
  }

  /** However often it is asked for meanwhile, they are read once more. */
  refreshSnapshots(): Promise<void> {
    this.snapshotsChanged = true;
    this.snapshotsRead ??= this.readSnapshots().finally(() => (this.snapshotsRead = undefined));
    return this.snapshotsRead;
  }

  private async readSnapshots(): Promise<void> {
    while (this.snapshotsChanged) {
      this.snapshotsChanged = false;
      await this.attempt(async () => {
        this.snapshots.value = (await simulations.listSnapshots({ simulation: this.name })).snapshots;
      });
    }
  }

  /** Modes about the present state, nearest to a frequency in hertz. A run waits for them. */
  async eigenmodes(count: number, shift: number): Promise<Mode[]> {
    let modes: Mode[] = [];
    await this.between(async () => {
      const [eigen, names] = await this.patiently(() => Promise.all([eigenvectors(this.name, 2 * count, shift), stateNames(this.name)]));
      modes = modesOf(eigen, names, this.geometry);
    });
    return modes;
  }

  private async attempt(work: () => Promise<void>): Promise<void> {
    try {
      await work();
    } catch (thrown) {
      const failure = failureOf(thrown);
      if (!failure.cancelled) this.tell(failure);
    }
  }

  private tell(failure: Failure): void {
    this.failure.value = failure;
    this.note(failure.message, 'error');
  }

  /** What the deck's reader said, and what the deck printed. */
  hear(findings: Diagnostic[], printed: string): void {
    this.findings.value = findings;
    for (const { file, line, message } of findings) this.note(`${line ? `${file}:${line}: ` : ''}${message}`);
    for (const line of printed.split('\n')) if (line) this.note(line);
  }

  note(text: string, level: 'info' | 'error' = 'info', wall = new Date()): void {
    this.log.value = [...this.log.value.slice(-199), { wall, text, level }];
  }
}

/** Wall time between samples, in seconds, so that the page never slows a run. */
function shortestInterval({ width }: Layout): number {
  return Math.max(1 / RATE, (width * Float64Array.BYTES_PER_ELEMENT) / BYTES);
}
