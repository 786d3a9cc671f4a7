/** The page put together. */
import { failureOf } from './api';
import { Desk } from './desk';
import { download, h, icon, iconButton } from './dom';
import { csv, fileName, recordingPage } from './export';
import { Home, STATES, type Heard } from './panels/home';
import { inputsPanel } from './panels/inputs';
import { logPanel } from './panels/log';
import { modesPanel } from './panels/modes';
import { plotsPanel } from './panels/plots';
import { ScenePanel, toggle } from './panels/scene_panel';
import { selectionPanel } from './panels/selection';
import { snapshotsPanel } from './panels/snapshots';
import { solverPanel } from './panels/solver';
import { TimeBar } from './panels/time_bar';
import { treePanel } from './panels/tree';
import { diagnosticsList } from './panels/diagnostics';
import { Session, type Shown } from './session';

const KEYS: [string, string][] = [
  ['Space', 'run and pause'], ['S', 'one step'], ['← →', 'one recorded sample back, on (turn the scene, walk the tree while they have the focus)'],
  ['L', 'back to live'], ['B', 'save the state'], ['/', 'search'], ['F', 'follow the selected node'], ['T', 'trail of the selected node'],
  ['Z', 'look at what is selected'], ['H', 'whole model'], ['1 2 3', 'views along the axes'], ['O', 'parallel projection'], ['D', 'dark and light'], ['?', 'these keys'],
];

const GONE = 'The daemon does not know this simulation any more. What was seen of it can still be looked at; others are in the list of simulations.';

export class App {
  readonly desk = new Desk();
  readonly scene = new ScenePanel(this.desk);
  readonly home = new Home(this.desk, (name, heard) => void this.open(name, heard), (name) => void this.compare(name));
  private readonly time = new TimeBar(this.desk);
  private readonly banner = h('div', { class: 'banner hidden', role: 'alert' });
  private readonly chip = h('span', { class: 'chip' });
  private readonly name = h('h1', { class: 'title' });
  private readonly shell: HTMLElement;
  private readonly left = h('nav', { class: 'left', 'aria-label': 'Model' });
  private readonly help = this.helpDialog();
  private unwatch: (() => void)[] = [];
  /** What the banner is about; empty: nothing. */
  private said: unknown = '';
  /** Numbers of what was opened, and compared with, last. */
  private opened = 0;
  private compared = 0;

  /** `page`: text of the page before it shows anything. `recorded`: what it holds, if it is a recording. */
  constructor(root: HTMLElement, private readonly page: string, private readonly recorded?: Shown) {
    this.shell = h('div', { class: 'shell', 'data-tab': 'scene' }, this.top(), this.left, this.middle(), this.right(), this.time.element, this.narrowTabs(), this.help);
    root.replaceChildren(this.shell);
    this.fillLeft();
    this.setTheme((localStorageGet('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark')) as 'dark' | 'light');
    this.desk.shown.watch(() => this.connect());
    document.addEventListener('keydown', (event) => this.key(event));
    if (recorded) this.desk.show(recorded);
    else void this.start();
  }

  private async start(): Promise<void> {
    const known = await this.home.refresh();
    const wanted = new URLSearchParams(location.hash.slice(1)).get('simulation');
    const name = wanted ?? (known.length === 1 ? known[0].name : undefined);
    if (name) await this.open(name);
    else if (known.length > 0) this.tab('model');  // where the screen is narrow the list is in there
    void this.home.follow();
    window.addEventListener('hashchange', () => {
      const next = new URLSearchParams(location.hash.slice(1)).get('simulation');
      if (next === this.desk.session?.name) this.opened += 1;  // what is on its way is not wanted any more
      else if (next) void this.open(next);
    });
  }

  /** Shows a simulation, unless another is opened before it is there. */
  async open(name: string, heard?: Heard): Promise<void> {
    const wish = ++this.opened;
    try {
      const session = await Session.open(name);
      if (wish !== this.opened) return session.close();
      if (heard) session.hear(heard.diagnostics, heard.printed);
      this.desk.show(session);
      history.replaceState(null, '', `#simulation=${encodeURIComponent(name)}`);
      void this.home.refresh();
      this.tab('scene');
    } catch (thrown) {
      if (wish === this.opened) this.home.tell(failureOf(thrown));
    }
  }

  private async compare(name: string): Promise<void> {
    const wish = ++this.compared, shown = this.desk.shown.value;
    try {
      const session = await Session.open(name);
      if (wish !== this.compared || shown !== this.desk.shown.value) return session.close();
      this.scene.compareWith(session);
    } catch (thrown) {
      this.home.tell(failureOf(thrown));
    }
  }

  // ---- parts

  private top(): HTMLElement {
    const entry = (picture: string, label: string, action: () => void) => h('button', { type: 'button', class: 'button', onclick: () => {
      save.click();  // closes the menu
      save.focus();
      action();
    } }, icon(picture), label);
    const table = entry('plot', 'Table of the plots (CSV)', () => this.saveTable());
    this.desk.plots.watch((plots) => (table.disabled = plots.length === 0));
    const menu = h('div', { class: 'menu hidden' },
      entry('camera', 'Picture (PNG)', () => void this.savePicture()),
      table,
      this.recorded ? '' : entry('download', 'Recording (HTML)', () => this.saveRecording()));
    const save: HTMLButtonElement = h('button', { type: 'button', class: 'button', 'aria-label': 'Export', 'aria-expanded': 'false', onclick: () => toggle(save, menu) }, icon('download'), h('span', {}, 'Export'));
    const brand = h('div', { class: 'brand' });
    brand.innerHTML = '<svg viewBox="0 0 32 32" aria-hidden="true"><path d="M5 8h9l9 14" fill="none" stroke="#35c2a8" stroke-width="3"/><circle cx="5" cy="8" r="4" fill="#f0a13c"/><circle cx="14" cy="8" r="3" fill="#9aa7b4"/><circle cx="23" cy="23" r="5.4" fill="#4aa8ff"/></svg>';
    brand.append('mbcosim');
    return h('header', { class: 'top' }, brand, this.name, this.chip, h('span', { class: 'spacer' }), h('div', { class: 'anchor end' }, save, menu),
      iconButton('theme', 'Dark and light (D)', () => this.setTheme(this.desk.theme.value === 'dark' ? 'light' : 'dark')),
      iconButton('help', 'Keys (?)', () => this.help.showModal()));
  }

  private fillLeft(): void {
    const tree = treePanel(this.desk);
    if (this.recorded) return this.left.replaceChildren(tree);
    const ask = () => {
      this.home.askForDeck();
      this.tab('scene');
    };
    const list = h('div', { class: 'pane hidden' }, h('div', { class: 'search' }, h('button', { type: 'button', class: 'button', onclick: ask }, icon('upload'), 'Load a deck')), this.home.list);
    const tabs: [HTMLButtonElement, HTMLElement][] = [
      [h('button', { type: 'button', role: 'tab', 'aria-selected': 'true' }, 'Model'), tree],
      [h('button', { type: 'button', role: 'tab', 'aria-selected': 'false' }, 'Simulations'), list],
    ];
    for (const [button, pane] of tabs)
      button.addEventListener('click', () => {
        for (const [other, otherPane] of tabs) {
          other.setAttribute('aria-selected', String(other === button));
          otherPane.classList.toggle('hidden', otherPane !== pane);
        }
      });
    this.left.replaceChildren(h('div', { class: 'tabs', role: 'tablist' }, ...tabs.map(([button]) => button)), tree, list);
    this.desk.shown.watch((shown) => tabs[shown ? 0 : 1][0].click());
  }

  private middle(): HTMLElement {
    this.scene.element.append(this.banner);
    return h('main', { class: 'main' }, this.scene.element, plotsPanel(this.desk), this.home.welcome);
  }

  private right(): HTMLElement {
    const acting = (panel: HTMLElement) => (panel.classList.add('acting'), panel);
    return h('aside', { class: 'right', 'aria-label': 'Panels' },
      selectionPanel(this.desk, this.scene),
      acting(inputsPanel(this.desk)),
      acting(snapshotsPanel(this.desk, (name) => void this.open(name))),
      solverPanel(this.desk),
      acting(modesPanel(this.desk, (mode, size) => this.scene.animate(mode, size))),
      logPanel(this.desk));
  }

  private narrowTabs(): HTMLElement {
    const tabs = ([['scene', 'eye', 'Scene'], ['model', 'list', 'Model'], ['plots', 'plot', 'Plots'], ['panel', 'layers', 'Panels']] as const).map(([tab, picture, label]) =>
      h('button', { type: 'button', role: 'tab', 'data-tab': tab, 'aria-selected': String(tab === 'scene'), onclick: () => this.tab(tab) }, icon(picture), label));
    return h('div', { class: 'nav', role: 'tablist', 'aria-label': 'Parts of the page' }, ...tabs);
  }

  private tab(name: string): void {
    this.shell.dataset.tab = name;
    for (const button of this.shell.querySelectorAll('.nav button')) button.setAttribute('aria-selected', String(button.getAttribute('data-tab') === name));
  }

  private helpDialog(): HTMLDialogElement {
    const dialog: HTMLDialogElement = h('dialog', { 'aria-label': 'Keys' }, h('h1', { style: 'font-size:18px' }, 'Keys'),
      h('div', { class: 'keys' }, ...KEYS.flatMap(([key, meaning]) => [h('span', {}, ...key.split(' ').map((part) => h('kbd', {}, part))), h('span', {}, meaning)])),
      h('button', { type: 'button', class: 'button', onclick: () => dialog.close() }, 'Close'));
    return dialog;
  }

  // ---- what changes

  private connect(): void {
    this.unwatch.forEach((end) => end());
    const session = this.desk.session;
    this.unwatch = session
      ? [session.info.watch(() => this.updateState()), session.lost.watch(() => this.updateState()), session.gone.watch(() => this.updateState()), session.failure.watch(() => this.updateState()), session.findings.watch(() => this.updateState())]
      : [];
    this.updateState();
  }

  private updateState(): void {
    const session = this.desk.session, title = this.desk.shown.value?.title;
    this.shell.classList.toggle('nothing', title === undefined);
    this.shell.classList.toggle('gone', !this.desk.alive);
    if (this.name.textContent !== (title ?? '')) this.name.textContent = title ?? '';
    document.title = title === undefined ? 'mbcosim' : `${title} – mbcosim`;
    this.chip.classList.toggle('hidden', !this.desk.shown.value);
    if (!session) {
      this.chip.className = `chip${this.desk.shown.value ? '' : ' hidden'}`;
      this.chip.textContent = 'recording';
      return this.say('');
    }
    const gone = session.gone.value, lost = session.lost.value, state = lost ? 'lost' : STATES[session.info.value.state] ?? 'unknown';
    this.chip.className = `chip ${state}`;
    this.chip.textContent = gone ? 'gone' : state === 'lost' ? 'no connection' : state;
    const { waits } = session.info.value, waiting = waits.map((wait) => `waits ${wait.hasPeer ? 'for the peer of' : 'for a peer on'} port ${wait.port}`);
    const failure = session.failure.value;
    this.banner.classList.toggle('bad', failure !== undefined || state === 'lost');
    const findings = session.findings.value, close = (read: () => void) => iconButton('close', 'Close', read, { class: 'icon-button small' });
    if (failure && !gone && !(lost && failure.passing))
      this.say(failure, () => [h('div', { class: 'text' }, h('strong', {}, failure.message), this.worst(), diagnosticsList(failure.diagnostics)), close(() => (session.failure.value = undefined))]);
    else if (lost) this.say(gone ? GONE : lost);
    else if (findings.length > 0 && waits.length === 0) this.say(findings, () => [h('div', { class: 'text' }, diagnosticsList(findings)), close(() => (session.findings.value = []))]);
    else this.say(waiting.join('\n'), () => [h('div', { class: 'text' }, ...waiting.map((words) => h('div', {}, words, h('span', { class: 'since', 'aria-hidden': 'true' }))))]);
    this.banner.querySelectorAll('.since').forEach((since, i) => (since.textContent = ` since ${waits[i].seconds.toFixed(1)} s`));
  }

  /** Fills the banner anew only when it is about something else: what is in it may have the focus or be selected, and is read aloud. */
  private say(about: unknown, content = (): HTMLElement[] => [h('div', { class: 'text' }, String(about))]): void {
    if (about === this.said) return;
    this.said = about;
    this.banner.classList.toggle('hidden', about === '');
    this.banner.replaceChildren(...(about === '' ? [] : content()));
  }

  private worst(): HTMLElement | string {
    const equations = this.desk.session?.failure.value?.solver?.worstEquations.slice(0, 3) ?? [];
    return equations.length > 0 ? h('div', { class: 'soft' }, equations.map((row) => `${row.owner}: ${row.equation}, residual ${row.residual.toExponential(2)}`).join('\n')) : '';
  }

  private setTheme(theme: 'dark' | 'light'): void {
    document.documentElement.dataset.theme = theme;
    this.desk.theme.value = theme;
    localStorageSet('theme', theme);
  }

  // ---- export

  private fileName(ending: string): string {
    return fileName(this.desk.shown.value?.title ?? 'mbcosim', ending);
  }

  private async savePicture(): Promise<void> {
    const picture = await this.scene.view.picture();
    if (picture) download(this.fileName('png'), picture);
  }

  private saveTable(): void {
    const shown = this.desk.shown.value;
    if (shown) download(this.fileName('csv'), new Blob([csv(shown.recording.samples, this.desk.plots.value)], { type: 'text/csv' }));
  }

  private saveRecording(): void {
    const shown = this.desk.shown.value;
    if (shown) download(this.fileName('html'), new Blob([recordingPage(this.page, shown)], { type: 'text/html' }));
  }

  // ---- keys

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) || this.help.open) return;
    if (event.key === ' ' && /^(BUTTON|SUMMARY)$/.test(target.tagName)) return;
    const press = (label: string) => this.shell.querySelector<HTMLButtonElement>(`button[title*="(${label})"]`)?.click();
    const actions: Record<string, () => void> = {
      ' ': () => this.time.toggle(),
      s: () => this.time.step(1),
      ArrowLeft: () => this.time.nudge(-1),
      ArrowRight: () => this.time.nudge(1),
      l: () => this.time.goLive(),
      b: () => void this.desk.alive?.saveSnapshot(''),
      '/': () => this.shell.querySelector<HTMLInputElement>('.search input')?.focus(),
      f: () => press('F'),
      t: () => this.scene.toggleTrail(),
      z: () => this.scene.lookAt(this.desk.selected.value),
      h: () => this.scene.view.look('iso'),
      '1': () => this.scene.view.look('front'),
      '2': () => this.scene.view.look('side'),
      '3': () => this.scene.view.look('top'),
      o: () => press('O'),
      d: () => press('D'),
      '?': () => this.help.showModal(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    action();
    event.preventDefault();
  }
}

/** Storage may be forbidden, as in recordings opened from a disk. */
function localStorageGet(key: string): string | undefined {
  try {
    return localStorage.getItem(`mbcosim.${key}`) ?? undefined;
  } catch {
    return undefined;
  }
}

function localStorageSet(key: string, value: string): void {
  try {
    localStorage.setItem(`mbcosim.${key}`, value);
  } catch {
    // not remembered, then
  }
}
