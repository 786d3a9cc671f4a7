/** A daemon with a deck, and a browser before it. */
import { spawn, type ChildProcess } from 'node:child_process';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { createServer, request } from 'node:http';
import { fileURLToPath } from 'node:url';
import { chromium, type Browser, type Page } from 'playwright-core';
import { expect } from 'vitest';

export const FACTOR = Number(process.env.MBCOSIM_TIME_FACTOR ?? 1);
const ROOT = fileURLToPath(new URL('../../..', import.meta.url));
const BIN = process.env.MBCOSIM_BIN ?? `${ROOT}/build/bin`;
export const MODELS = `${ROOT}/client_examples/models`;
export const decks = (): string[] => readdirSync(MODELS).filter((name) => name.endsWith('.mbd')).sort();

interface VariableOfJson {
  name: string;
  handle: number;
  size: number;
}

/** `mbcosim view DECK`. */
export class View {
  private constructor(private readonly child: ChildProcess, readonly address: string) {}

  static start(deck: string): Promise<View> {
    const child = spawn(`${BIN}/mbcosim`, ['view', deck.includes('/') ? deck : `${MODELS}/${deck}`], { stdio: ['ignore', 'pipe', 'pipe'] });
    let said = '';
    return new Promise((resolve, reject) => {
      const hear = (data: Buffer) => {
        said += data;
        const address = /^(http:\S+)$/m.exec(said)?.[1];
        if (address) resolve(new View(child, address));
      };
      child.stdout?.on('data', hear);
      child.stderr?.on('data', (data: Buffer) => (said += data));
      child.on('exit', (code) => reject(new Error(`mbcosim view ended with ${code}: ${said}`)));
    });
  }

  get origin(): string {
    return new URL(this.address).origin;
  }

  get token(): string {
    return new URL(this.address).searchParams.get('token') ?? '';
  }

  get simulation(): string {
    return new URL(this.address).hash.replace('#simulation=', '');
  }

  /** A unary call in JSON. */
  call<T>(method: string, request: object): Promise<T> {
    return call(this.origin, this.token, method, request);
  }

  /** All pages of a model's variables. */
  async variables(simulation = this.simulation): Promise<VariableOfJson[]> {
    const all: VariableOfJson[] = [];
    let pageToken = '';
    do {
      const page = await this.call<{ model: { variables?: VariableOfJson[] }; nextPageToken?: string }>('Simulations/DescribeSimulation', { simulation, pageToken });
      all.push(...(page.model.variables ?? []));
      pageToken = page.nextPageToken ?? '';
    } while (pageToken);
    return all;
  }

  /** Values of variables at the last accepted step, by name. */
  async read(names: string[], simulation = this.simulation): Promise<{ step: number; time: number; values: Record<string, number[]> }> {
    const variables = await this.variables(simulation);
    const chosen = names.map((name) => variables.find((variable) => variable.name === name) ?? fail(`no variable ${name}`));
    const reply = await this.call<{ step: string; time: number; values: number[] }>('Simulations/ReadVariables', { simulation, handles: chosen.map((variable) => variable.handle) });
    const values: Record<string, number[]> = {};
    let at = 0;
    for (const { name, size } of chosen) values[name] = reply.values.slice(at, (at += size));
    return { step: Number(reply.step), time: reply.time, values };
  }

  async stop(): Promise<void> {
    if (this.child.exitCode !== null || this.child.signalCode !== null) return;
    const ended = new Promise((resolve) => this.child.on('exit', resolve));
    this.child.kill('SIGTERM');
    await ended;
  }
}

const TOKEN = 'a-token-of-the-tests';

/** `mbcosimd` at a port of the caller's, with one token; `openSocket`: none is asked for at its socket, and the door has one of its own. It can
 * be started again where it was. */
export class Daemon {
  token: string | undefined;
  private child?: ChildProcess;

  constructor(private readonly folder: string, readonly port: number, private readonly options: string[] = [], private readonly openSocket = false) {
    writeFileSync(`${folder}/tokens`, `${TOKEN} control reader\n`);
  }

  get origin(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  /** Address for gRPC. */
  get socket(): string {
    return `unix:${this.folder}/socket`;
  }

  async start(): Promise<void> {
    const tokens = this.openSocket ? [] : ['--tokens', `${this.folder}/tokens`];
    const child = spawn(`${BIN}/mbcosimd`, ['--listen', this.socket, '--http', `127.0.0.1:${this.port}`, ...tokens, ...this.options], { stdio: ['ignore', 'pipe', 'ignore'] });
    let said = '';
    this.token = this.openSocket ? undefined : TOKEN;
    child.stdout?.on('data', (data: Buffer) => {
      said += data;
      this.token ??= /token=(\S+)\s/.exec(said)?.[1];
    });
    this.child = child;
    const end = Date.now() + 20_000 * FACTOR;
    while (this.token === undefined || !(await ask(`${this.origin}/healthz`).then(({ status }) => status === 200, () => false))) {
      if (child.exitCode !== null || Date.now() > end) throw new Error(`the daemon does not start: ${child.exitCode}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }

  /** Another program of the build. */
  run(program: string, ...options: string[]): ChildProcess {
    return spawn(`${BIN}/${program}`, options, { stdio: 'ignore' });
  }

  kill(): Promise<void> {
    return this.signal('SIGKILL');
  }

  /** In order. */
  end(): Promise<void> {
    return this.signal('SIGTERM');
  }

  private async signal(name: NodeJS.Signals): Promise<void> {
    if (!this.child || this.child.exitCode !== null || this.child.signalCode !== null) return;
    const ended = new Promise((resolve) => this.child?.on('exit', resolve));
    this.child.kill(name);
    await ended;
  }
}

/** A port that nobody listens at. */
export async function freePort(): Promise<number> {
  const server = createServer();
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  const { port } = server.address() as { port: number };
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** Status and text of what is answered; POST where there is a body. On a connection of its own: one that is kept open may be closed by the
 * daemon in the moment in which it is used again. */
export function ask(url: string, headers: Record<string, string> = {}, body?: string): Promise<{ status: number; text: string }> {
  return new Promise((resolve, reject) => {
    const call = request(url, { agent: false, method: body === undefined ? 'GET' : 'POST', headers }, (reply) => {
      let text = '';
      reply.setEncoding('utf8').on('data', (data: string) => (text += data)).on('error', reject).on('end', () => resolve({ status: reply.statusCode ?? 0, text }));
    });
    call.on('error', reject).end(body);
  });
}

/** Passes on what is asked for under `prefix`, without it, as proxies do. */
export async function proxy(target: string, prefix: string): Promise<{ origin: string; close(): void }> {
  const server = createServer((asked, reply) => {
    if (!asked.url?.startsWith(`${prefix}/`)) return void reply.writeHead(404).end();
    const headers = { ...asked.headers, host: new URL(target).host, ...(asked.headers.origin && { origin: target }) };
    const passed = request(target + asked.url.slice(prefix.length), { method: asked.method, headers }, (answer) => {
      reply.writeHead(answer.statusCode ?? 502, answer.headers);
      answer.pipe(reply);
    });
    passed.on('error', () => reply.destroy());
    reply.on('close', () => passed.destroy());
    asked.pipe(passed);
  });
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { origin: `http://127.0.0.1:${(server.address() as { port: number }).port}`, close: () => void server.close().closeAllConnections() };
}

/** A unary call in JSON. */
async function call<T>(origin: string, token: string | undefined, method: string, content: object): Promise<T> {
  const { status, text } = await ask(`${origin}/mbcosim.v1.${method}`, { 'Content-Type': 'application/json', Authorization: `Bearer ${token}` }, JSON.stringify(content));
  if (status !== 200) throw new Error(`${method}: ${status} ${text}`);
  return JSON.parse(text) as T;
}

/** Loads an example deck with whatever it includes; the simulation's name. */
export async function create(server: { origin: string; token?: string }, deck: string, options: object = {}): Promise<string> {
  const files = readdirSync(MODELS).filter((name) => name === deck || /\.(inc|fem)$/.test(name));
  const { simulation } = await call<{ simulation: { name: string } }>(server.origin, server.token, 'Simulations/CreateSimulationInline', {
    header: { bundleMainFile: deck, options: { displayName: deck, ...options } },
    files: files.map((path) => ({ path, data: readFileSync(`${MODELS}/${path}`).toString('base64') })),
  });
  return simulation.name;
}

function fail(message: string): never {
  throw new Error(message);
}

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: [
      '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
      '--disable-gpu', '--enable-unsafe-swiftshader',  // as on a machine without a graphics card
    ],
  });
}

export interface Visit {
  page: Page;
  /** Errors of the console, exceptions, and requests to other hosts. */
  faults: string[];
  close(): Promise<void>;
}

/** With `MBCOSIM_PAGE`, that file is shown in place of the daemon's page: tries a page without a new daemon. */
async function prepared(page: Page, address: string): Promise<string> {
  const file = process.env.MBCOSIM_PAGE, { protocol, origin, pathname, search, hash } = new URL(address);
  if (!file || protocol === 'file:') return address;
  if (search) await page.goto(address);  // the token becomes a cookie
  await page.goto('about:blank');
  await page.route((url) => url.origin === origin && url.pathname === pathname, (route) => route.fulfill({ contentType: 'text/html', body: readFileSync(file, 'utf8') }));
  return `${origin}${pathname}${hash}`;
}

/** Opens an address in a fresh profile. */
export async function visit(browser: Browser, address: string, options: { width?: number; height?: number; dark?: boolean } = {}): Promise<Visit> {
  const context = await browser.newContext({
    viewport: { width: options.width ?? 1280, height: options.height ?? 800 },
    colorScheme: options.dark === false ? 'light' : 'dark',
    acceptDownloads: true,
    reducedMotion: 'reduce',
  });
  const page = await context.newPage();
  const faults: string[] = [];
  const origin = new URL(address).origin;
  page.on('console', (message) => message.type() === 'error' && faults.push(message.text()));
  page.on('pageerror', (error) => faults.push(String(error)));
  page.on('request', (request) => {
    const url = new URL(request.url());
    if (!['data:', 'blob:', 'file:'].includes(url.protocol) && url.origin !== origin) faults.push(`request to ${url.origin}`);
  });
  page.setDefaultTimeout(20_000 * FACTOR);
  await page.goto(await prepared(page, address));
  return { page, faults, close: () => context.close() };
}

/** The address in another tab of the browser, once a simulation is on show. */
export async function newTab(page: Page, address: string): Promise<Page> {
  const tab = await page.context().newPage();
  tab.setDefaultTimeout(20_000 * FACTOR);
  await tab.goto(await prepared(tab, address));
  await shown(tab);
  return tab;
}

/** Tells the page that nobody sees its tab. */
export async function hide(page: Page): Promise<void> {
  await page.evaluate(() => Object.defineProperty(document, 'hidden', { get: () => true }));
}

/** Waits until samples come to the page by a stream. */
export function follows(page: Page): Promise<void> {
  return until(page, () => (window as unknown as Inside).mbcosim.desk.session?.following === true, undefined);
}

/** Runs `work` with a daemon of its own and a page on it; no error may be left in the console. */
export async function withPage(browser: Browser, deck: string, work: (visit: Visit, view: View) => Promise<void>, options?: Parameters<typeof visit>[2]): Promise<void> {
  const view = await View.start(deck);
  let visited: Visit | undefined;
  try {
    visited = await visit(browser, view.address, options);
    await shown(visited.page);
    await work(visited, view);
    expect(visited.faults).toEqual([]);
  } finally {
    await visited?.close();
    void view.stop();  // the next test need not wait for it
  }
}

/** What the page has inside, as far as tests look at it. */
interface Inside {
  mbcosim: {
    desk: {
      shown: { value?: {
        geometry: { nodes: { label: number }[] };
        model: { variables: { name: string; handle: number }[] };
        recording: { samples: { step: number; time: number; layout: { offset(handle: number): number | undefined }; values: Float64Array }[] };
      } };
      session?: { name: string; playing: { value: string }; busy: boolean; following: boolean };
      sample?: { step: number; time: number };
      calm: { value: number };
    };
    scene: {
      view: {
        nodeMatrix(index: number): number[]; trails?: { object: { geometry: { attributes: { position?: { array: ArrayLike<number> } } } } }; picture(): Promise<Blob>; drawCalls: number; layers(): string[];
        camera: { projectionMatrix: { elements: number[] }; matrixWorldInverse: { elements: number[] } };
        canvas: HTMLCanvasElement;
        renderer: { info: { memory: { geometries: number } } };
        drawn: { batches: { layer: string; batch: { where: ArrayLike<number> } }[] };
      };
    };
  };
}

/** Waits until `condition` holds in the page. (The page's content policy forbids what Playwright's own waiting does.) */
export async function until<T>(page: Page, condition: (argument: T) => boolean, argument: T): Promise<void> {
  const end = Date.now() + 20_000 * FACTOR;
  while (!(await page.evaluate(condition as (argument: unknown) => boolean, argument))) {
    if (Date.now() > end) throw new Error(`waited too long for ${condition}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** Opens another simulation of the same daemon and waits until it is on show. */
export async function turnTo(page: Page, simulation: string): Promise<void> {
  await page.evaluate((name) => (location.hash = `simulation=${encodeURIComponent(name)}`), simulation);
  await until(page, (name) => {
    const { desk } = (window as unknown as Inside).mbcosim;
    return desk.session?.name === name && desk.sample !== undefined;
  }, simulation);
}

/** Waits until a simulation is on show. */
export async function shown(page: Page): Promise<void> {
  await until(page, () => (window as unknown as Inside).mbcosim?.desk.sample !== undefined, undefined);
}

/** Waits until the samples of the page have a variable. */
export async function samplesHave(page: Page, name: string): Promise<void> {
  await until(page, (wanted) => {
    const shown = (window as unknown as Inside).mbcosim.desk.shown.value;
    const handle = shown?.model.variables.find((variable) => variable.name === wanted)?.handle;
    return handle !== undefined && shown?.recording.samples.at(-1)?.layout.offset(handle) !== undefined;
  }, name);
}

/** Moves a slider, and shows the last sample once more in the same turn of the page. */
export async function moveSliderUnderSample(page: Page, label: string, value: string): Promise<void> {
  await page.evaluate(([name, wanted]) => {
    const slider = document.querySelector<HTMLInputElement>(`input[type=range][aria-label="${name}"]`);
    if (!slider) throw new Error(`no slider ${name}`);
    slider.value = wanted;
    slider.dispatchEvent(new Event('input'));
    (window as unknown as Inside).mbcosim.desk.calm.value += 1;
  }, [label, value]);
}

/** Matrices of the nodes in the scene, 16 numbers by columns, by label, and the step that they belong to. */
export function scene(page: Page): Promise<{ step: number; nodes: Record<string, number[]> }> {
  return page.evaluate(
    () =>
      new Promise<{ step: number; nodes: Record<string, number[]> }>((resolve) => {
        const { desk, scene: { view } } = (window as unknown as Inside).mbcosim;
        requestAnimationFrame(() => requestAnimationFrame(() => {
          const nodes: Record<string, number[]> = {};
          desk.shown.value?.geometry.nodes.forEach((node, i) => (nodes[node.label] = view.nodeMatrix(i)));
          resolve({ step: desk.sample?.step ?? -1, nodes });
        }));
      }),
  );
}

/** Where the node with a label is seen, once what was asked for is drawn: pixels of the window; from −1 to 1 across the scene. */
export async function placeOf(page: Page, label: number): Promise<{ x: number; y: number; across: number; up: number }> {
  await scene(page);  // the camera's matrices are made when it is drawn
  return page.evaluate((wanted) => {
    const { desk, scene: { view } } = (window as unknown as Inside).mbcosim;
    const index = desk.shown.value?.geometry.nodes.findIndex((node) => node.label === wanted) ?? -1;
    const times = (m: number[], v: number[]) => [0, 1, 2, 3].map((row) => v.reduce((sum, value, k) => sum + m[4 * k + row] * value, 0));
    const at = times(view.camera.projectionMatrix.elements, times(view.camera.matrixWorldInverse.elements, [...view.nodeMatrix(index).slice(12, 15), 1]));
    const across = at[0] / at[3], up = at[1] / at[3], box = view.canvas.getBoundingClientRect();
    return { x: box.left + ((across + 1) / 2) * box.width, y: box.top + ((1 - up) / 2) * box.height, across, up };
  }, label);
}

/** The trails that are drawn: ends of their pieces, three numbers each. */
export function trails(page: Page): Promise<number[]> {
  return page.evaluate(() => Array.from((window as unknown as Inside).mbcosim.scene.view.trails?.object.geometry.attributes.position?.array ?? []));
}

/** Where the page has seen a variable go, three numbers each. */
export function recordedPath(page: Page, variable: string): Promise<number[]> {
  return page.evaluate((name) => {
    const { recording, model } = (window as unknown as Inside).mbcosim.desk.shown.value ?? {}, handle = model?.variables.find((known) => known.name === name)?.handle ?? -1;
    return recording?.samples.flatMap(({ layout, values }) => Array.from(values.slice(layout.offset(handle), (layout.offset(handle) ?? 0) + 3))) ?? [];
  }, variable);
}

/** Whether all nodes are seen. */
export async function inView(page: Page): Promise<boolean> {
  const { nodes } = await scene(page);
  const places = await Promise.all(Object.keys(nodes).map((label) => placeOf(page, Number(label))));
  return places.every(({ across, up }) => Math.abs(across) < 1 && Math.abs(up) < 1);
}

/** Points of the flexible bodies as they are drawn, three numbers each. */
export function flexiblePoints(page: Page): Promise<number[]> {
  return page.evaluate(() => (window as unknown as Inside).mbcosim.scene.view.drawn.batches.filter(({ layer }) => layer === 'flexible').flatMap(({ batch }) => Array.from(batch.where)));
}

/** Kinds of things that the scene has. */
export function drawnLayers(page: Page): Promise<string[]> {
  return page.evaluate(() => (window as unknown as Inside).mbcosim.scene.view.layers());
}

/** Waits until the page has seen that time of the simulation. */
export function samplesReach(page: Page, time: number): Promise<void> {
  return until(page, (time) => ((window as unknown as Inside).mbcosim.desk.shown.value?.recording.samples.at(-1)?.time ?? 0) >= time, time);
}

/** Waits until no step of the page's is under way. */
export function rested(page: Page): Promise<void> {
  return until(page, () => {
    const { session } = (window as unknown as Inside).mbcosim.desk;
    return session?.playing.value === 'no' && !session.busy;
  }, undefined);
}

/** Waits until in the plot with this number, from 0, so many curves are drawn: pixels have their colours. */
export function curvesDrawn(page: Page, plot: number, curves: number): Promise<void> {
  return until(page, ([at, wanted]) => {
    const box = document.querySelectorAll('.plot')[at], canvas = box?.querySelector('canvas');
    if (!canvas || canvas.width === 0) return false;
    const { data } = (canvas.getContext('2d') as CanvasRenderingContext2D).getImageData(0, 0, canvas.width, canvas.height);
    const colours = [...box.querySelectorAll<HTMLElement>('.curve i')].map((mark) => (getComputedStyle(mark).backgroundColor.match(/\d+/g) ?? []).map(Number));
    const count = colours.map(([r, g, b]) => {
      let pixels = 0;
      for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 60 && Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < 30) ++pixels;
      return pixels;
    });
    return count.filter((pixels) => pixels > 20).length >= wanted;
  }, [plot, curves] as [number, number]);
}

/** Steps that the page has recorded. */
export function recorded(page: Page): Promise<number[]> {
  return page.evaluate(() => (window as unknown as Inside).mbcosim.desk.shown.value?.recording.samples.map((sample) => sample.step) ?? []);
}

/** Waits until the page looks at this step. */
export async function atStep(page: Page, step: number): Promise<void> {
  await until(page, (wanted) => (window as unknown as Inside).mbcosim.desk.sample?.step === wanted, step);
}

/** Calls to the graphics card for the last picture. */
export function drawCalls(page: Page): Promise<number> {
  return page.evaluate(() => (window as unknown as Inside).mbcosim.scene.view.drawCalls);
}

/** Things that the graphics card keeps. */
export async function kept(page: Page): Promise<number> {
  await scene(page);  // what is on show is drawn
  return page.evaluate(() => (window as unknown as Inside).mbcosim.scene.view.renderer.info.memory.geometries);
}

/** Pictures a second, while the page replays what it recorded. */
export async function frameRate(page: Page, seconds: number): Promise<number> {
  return page.evaluate((wanted) => new Promise<number>((resolve) => {
    const { view } = (window as unknown as { mbcosim: { scene: { view: { render(ratio: number): void } } } }).mbcosim.scene, render = view.render;
    let frames = 0;
    view.render = (ratio) => (++frames, render.call(view, ratio));
    const start = performance.now();
    setTimeout(() => {
      view.render = render;
      resolve((1000 * frames) / (performance.now() - start));
    }, 1000 * wanted);
  }), seconds);
}

/** How many colours the scene has, and the part of it that is not background. */
export function picture(page: Page): Promise<{ colours: number; covered: number }> {
  return page.evaluate(async () => {
    const drawn = await createImageBitmap(await (window as unknown as Inside).mbcosim.scene.view.picture());
    const copy = document.createElement('canvas');
    copy.width = drawn.width, copy.height = drawn.height;
    const context = copy.getContext('2d') as CanvasRenderingContext2D;
    context.drawImage(drawn, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const colours = new Set<number>();
    const background = (data[0] << 16) | (data[1] << 8) | data[2];
    let covered = 0;
    for (let i = 0; i < data.length; i += 4) {
      const colour = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
      colours.add(colour);
      if (colour !== background) ++covered;
    }
    return { colours: colours.size, covered: covered / (data.length / 4) };
  });
}
