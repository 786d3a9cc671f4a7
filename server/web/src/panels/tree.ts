/** The model as a tree with search: nodes, elements, and their variables. */
import type { Desk } from '../desk';
import { h, iconButton } from '../dom';
import { finder, otherParts, partTitle, shortName, variablesByPart, type Model, type Part, type VariableInfo } from '../model';

/** Rows at once; a search finds the rest. */
const MOST = 400;

export function treePanel(desk: Desk): HTMLElement {
  const input = h('input', { type: 'search', placeholder: 'Search nodes, elements, variables', 'aria-label': 'Search the model' });
  const tree = h('div', { class: 'tree' });
  const open = new Set<string>();
  let byPart: ReadonlyMap<string, VariableInfo[]> = new Map(), families = new Map<string, Part[]>();
  let rows = new Map<string, HTMLElement>(), marked: HTMLElement | undefined;

  const draw = () => {
    rows = new Map();
    tree.replaceChildren(...(desk.shown.value ? groups() : []));
    mark();
  };

  /** Nothing else is touched when something is selected: it may have the focus. */
  const mark = () => {
    const row = rows.get(desk.selected.value ?? '');
    for (const [one, on] of [[marked, false], [row, true]] as const) {
      one?.classList.toggle('selected', on);
      one?.querySelector('.name')?.setAttribute('aria-current', String(on));
    }
    marked = row;
  };

  const groups = (): HTMLElement[] => {
    const query = input.value.trim(), matches = finder(query);
    const drawn: HTMLElement[] = [];
    let left = MOST;
    for (const [family, parts] of families) {
      const titled = (part: Part) => matches(`${partTitle(part)} ${part.family}`);
      const found = query ? parts.filter((part) => titled(part) || (byPart.get(part.id) ?? []).some((variable) => matches(variable.name))) : parts;
      if (found.length === 0) continue;
      drawn.push(h('div', { class: 'group' }, h('h2', {}, `${family} (${found.length})`)));
      const shown = found.slice(0, left);
      left -= shown.length;
      drawn.push(h('ul', {}, ...shown.map((part) => partRow(part, matches, query !== '' && !titled(part)))));
      if (shown.length < found.length) drawn.push(h('p', { class: 'soft group' }, `${found.length - shown.length} more: search for them`));
    }
    const own = (byPart.get('') ?? []).filter((variable) => matches(variable.name));
    if (own.length > 0) drawn.push(h('div', { class: 'group' }, h('h2', {}, 'model')), h('ul', { class: 'variables' }, ...own.map((variable) => variableRow(desk, variable))));
    return drawn.length > 0 ? drawn : [h('p', { class: 'soft group' }, 'Nothing is found.')];
  };

  const partRow = (part: Part, matches: (text: string) => boolean, found: boolean): HTMLElement => {
    const variables = byPart.get(part.id) ?? [], list = h('ul', { class: 'variables' });
    const expand = (on: boolean) => {
      twist.setAttribute('aria-expanded', String(on));
      const shown = on ? variables.filter((variable) => matches(`${partTitle(part)} ${variable.name}`)).slice(0, 100) : [];
      list.replaceChildren(...shown.map((variable) => variableRow(desk, variable)));
    };
    const twist = iconButton('play', `Variables of ${partTitle(part)}`, () => {
      const on = twist.getAttribute('aria-expanded') !== 'true';
      if (on) open.add(part.id);
      else open.delete(part.id);
      expand(on);
    }, { class: 'icon-button small twist' });
    expand(found || open.has(part.id));
    const row = h('div', { class: 'row' },
      variables.length > 0 ? twist : h('span', { class: 'twist' }),
      h('button', { type: 'button', class: 'name', onclick: () => (desk.selected.value = part.id) }, partTitle(part)));
    rows.set(part.id, row);
    return h('li', {}, row, list);
  };

  input.addEventListener('input', draw);
  desk.shown.watch((shown) => {
    byPart = variablesByPart(shown?.model.variables ?? []);
    families = shown ? byFamily(shown.model) : new Map();
    open.clear();
    input.value = '';
    draw();
  });
  desk.selected.watch(mark);
  return h('div', { class: 'pane' }, h('div', { class: 'search' }, input), tree);
}

function byFamily(model: Model): Map<string, Part[]> {
  const families = new Map<string, Part[]>();
  for (const part of [...model.nodes, ...model.elements, ...otherParts(model)]) {
    const family = part.id.startsWith('node.') ? `${part.family} nodes` : part.family, parts = families.get(family);
    if (parts) parts.push(part);
    else families.set(family, [part]);
  }
  return families;
}

/** A variable with its unit, to be plotted. */
export function variableRow(desk: Desk, variable: VariableInfo): HTMLElement {
  const name = shortName(variable.name);
  const about = [variable.description, variable.frame && `${variable.frame} frame`, variable.kind].filter(Boolean).join(', ');
  return h('li', { class: 'variable', title: `${variable.name}: ${about}` },
    h('span', { class: 'name' }, variable.size > 1 ? `${name} [${variable.size}]` : name),
    h('span', { class: 'unit' }, variable.unit),
    iconButton('plot', `Plot ${variable.name}`, () => desk.plot(variable), { class: 'icon-button small' }));
}

