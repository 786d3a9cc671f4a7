/** The list of simulations, and where a deck is dropped. */
import { failureOf, loadDeck, remedy, simulations, type Failure } from '../api';
import type { Desk } from '../desk';
import { arrange, h, icon, iconButton, rename } from '../dom';
import { number } from '../format';
import { SimulationState, type CreateSimulationInlineReply, type SimulationInfo } from '../gen/mbcosim/v1/simulations_pb';
import { listSimulations, told } from '../questions';
import { chosenFiles, droppedFiles, mainFiles, type NamedFile } from '../upload';
import { diagnosticsList } from './diagnostics';

const REFRESH_MILLISECONDS = 3000;

export const STATES: Record<number, string> = {
  [SimulationState.READY]: 'ready',
  [SimulationState.STEPPING]: 'stepping',
  [SimulationState.FINISHED]: 'finished',
  [SimulationState.FAILED]: 'failed',
  [SimulationState.SUSPENDED]: 'suspended',
};

/** A simulation in the list. */
interface Row {
  info: SimulationInfo;
  element: HTMLLIElement;
  name: HTMLElement;
  state: HTMLElement;
  compare: HTMLElement;
  remove: HTMLElement;
}

/** What the reader of a deck said, and what the deck printed. */
export type Heard = Pick<CreateSimulationInlineReply, 'diagnostics' | 'printed'>;

/** What the message is about. */
type About = 'nothing' | 'deck' | 'failure';

export class Home {
  /** The list for the left-hand side. */
  readonly list = h('ul', { class: 'list', style: 'padding:8px' });
  /** What stands in place of the scene while nothing is shown. */
  readonly welcome = h('div', { class: 'empty' });
  private readonly message = h('div', { 'aria-live': 'polite' });
  /** Why the daemon cannot be asked: told beside what is said of a deck, in place of a failure, and no longer than it is so. */
  private readonly connection = h('div', { 'aria-live': 'polite' });
  private readonly back = h('button', { type: 'button', class: 'button', onclick: () => this.welcome.classList.add('hidden') }, 'Back to the simulation');
  private about: About = 'nothing';
  private readonly none = h('li', { class: 'soft' }, 'No simulation yet.');
  private readonly rows = new Map<string, Row>();
  private known: SimulationInfo[] = [];

  constructor(private readonly desk: Desk, private readonly open: (name: string, heard?: Heard) => void, private readonly compare: (name: string) => void) {
    this.welcome.append(h('div', { class: 'box' },
      h('h1', {}, 'See it move'),
      h('p', { class: 'soft' }, 'Choose a simulation of this daemon, or bring a deck of your own.'),
      h('div', { class: 'drop' }, icon('upload'), h('p', {}, 'Drop a deck here, with the files that it includes, or its folder.'), this.chooser()),
      this.back, this.connection, this.message));
    this.acceptDrops();
    desk.shown.watch((shown) => {
      this.welcome.classList.toggle('hidden', shown !== undefined);
      this.back.classList.toggle('hidden', shown === undefined);
      this.draw();
    });
  }

  private chooser(): HTMLElement {
    const input = h('input', { type: 'file', multiple: true, class: 'visually-hidden', tabindex: -1, 'aria-label': 'Files of a deck' });
    input.addEventListener('change', () => {
      void this.take(chosenFiles(input.files as FileList));
      input.value = '';  // the same files may be chosen again when they have changed
    });
    return h('div', {}, h('button', { type: 'button', class: 'button primary', onclick: () => input.click() }, 'Choose files'), input);
  }

  private acceptDrops(): void {
    document.addEventListener('dragover', (event) => {
      event.preventDefault();
      document.body.classList.add('dropping');
    });
    document.addEventListener('dragleave', (event) => event.relatedTarget === null && document.body.classList.remove('dropping'));
    document.addEventListener('drop', (event) => {
      event.preventDefault();
      document.body.classList.remove('dropping');
      if (event.dataTransfer) void this.take(droppedFiles(event.dataTransfer));
    });
  }

  /** Asks for a deck, whatever is on show. */
  askForDeck(): void {
    this.say('nothing');
    this.welcome.classList.remove('hidden');
    this.welcome.querySelector('button')?.focus();
  }

  /** What is dropped may be no file. */
  private async take(reading: Promise<NamedFile[]>): Promise<void> {
    try {
      const files = await reading;
      if (files.length > 0) await this.load(files);
    } catch (thrown) {
      this.tell(failureOf(thrown));
    }
  }

  /** Loads a deck; where several files can be the main one, the reader says which. */
  private async load(files: NamedFile[], main?: string): Promise<void> {
    const mains = main ? [main] : mainFiles(files);
    if (mains.length !== 1) return this.choose(files, mains);
    this.say('deck', h('p', { class: 'soft' }, `Loading ${mains[0]} …`));
    try {
      const { simulation, diagnostics, printed } = await loadDeck(files, mains[0]);
      this.say('nothing');
      this.open(told(simulation).name, { diagnostics, printed });
    } catch (thrown) {
      this.tell(failureOf(thrown), files);
    }
  }

  private choose(files: NamedFile[], mains: string[]): void {
    this.welcome.classList.remove('hidden');
    if (mains.length === 0) return this.say('deck', h('div', { class: 'diagnostic' }, 'None of these files is a deck: a deck has a card "begin: data;".'));
    this.say('deck', h('p', {}, 'Which of them is the main file?'),
      ...[...mains].sort().map((path) => h('button', { type: 'button', class: 'button', onclick: () => void this.load(files, path) }, path)));
  }

  /** Keeps the list up to date until the page is left. */
  async follow(): Promise<void> {
    for (;;) {
      await this.refresh();
      await new Promise((resolve) => setTimeout(resolve, REFRESH_MILLISECONDS));
    }
  }

  async refresh(): Promise<SimulationInfo[]> {
    try {
      this.known = await listSimulations();
      this.connection.replaceChildren();
      this.draw();
    } catch (thrown) {
      this.tellLost(failureOf(thrown));
    }
    return this.known;
  }

  private tellLost(failure: Failure): void {
    if (this.about === 'failure') this.say('nothing');
    if (!this.desk.shown.value) this.welcome.classList.remove('hidden');
    const said = words(failure);
    if (!this.connection.firstChild?.isEqualNode(said)) this.connection.replaceChildren(said);  // is read aloud once
  }

  private say(about: About, ...words: Node[]): void {
    this.about = about;
    this.message.replaceChildren(...words);
  }

  tell(failure: Failure, files: readonly NamedFile[] = []): void {
    this.welcome.classList.remove('hidden');
    if (failure.diagnostics.length > 0) this.say('deck', diagnosticsList(failure.diagnostics, files));
    else this.say('failure', words(failure));
  }

  private draw(): void {
    const current = this.desk.session?.name;
    const elements = this.known.map((info) => {
      const row = this.rows.get(info.name) ?? this.row(info), text = `${STATES[info.state] ?? 'unknown'}, ${number(info.time, 5)} s, ${info.owner}`;
      this.rows.set(info.name, row);
      this.name(row, info);
      row.element.classList.toggle('current', info.name === current);
      row.compare.classList.toggle('hidden', !current || info.name === current);
      if (row.state.textContent !== text) row.state.textContent = text;
      return row.element;
    });
    if (elements.length === 0) elements.push(this.none);
    arrange(this.list, elements);
    const names = new Set(this.known.map((info) => info.name));
    for (const name of this.rows.keys()) if (!names.has(name)) this.rows.delete(name);
  }

  private row(info: SimulationInfo): Row {
    const state = h('div', { class: 'soft' });
    const compare = iconButton('eye', '', () => this.compare(info.name), { class: 'icon-button small' });
    const name = h('div'), remove = iconButton('trash', '', () => void this.remove(row.info), { class: 'icon-button small' });
    const element = h('li', { class: 'card' },
      h('button', { type: 'button', class: 'name body', style: 'background:none;border:0;text-align:left;cursor:pointer;padding:0', onclick: () => this.open(info.name) },
        name, state),
      compare, remove);
    const row = { info, element, name, state, compare, remove };
    return row;
  }

  /** Its name may have changed. */
  private name(row: Row, info: SimulationInfo): void {
    const name = info.displayName || info.name.replace('simulations/', ''), whole = info.displayName || info.name;
    row.info = info;
    if (row.name.textContent !== name) row.name.textContent = name;
    rename(row.compare, `Compare with ${whole}`);
    rename(row.remove, `Delete ${whole}`);
  }

  private async remove(info: SimulationInfo): Promise<void> {
    if (!confirm(`Delete the simulation ${info.displayName || info.name}?`)) return;
    try {
      await simulations.deleteSimulation({ simulation: info.name });
    } catch (thrown) {
      this.tell(failureOf(thrown));
    }
    await this.refresh();
  }
}

/** A failure, and what to do about it. */
function words(failure: Failure): HTMLElement {
  const hint = remedy(failure);
  return h('div', { class: 'diagnostic' }, h('strong', {}, failure.message), hint && h('p', {}, hint));
}
