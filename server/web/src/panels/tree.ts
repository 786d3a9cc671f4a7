/** The model as a tree with search: nodes, elements, and their variables. */
import type { Desk } from '../desk';
import { h, iconButton } from '../dom';
import { matches, otherParts, partTitle, shortName, variablesByPart, type Model, type Part, type VariableInfo } from '../model';

/** Rows at once; a search finds the rest. */
const MOST = 400;

export function treePanel(desk: Desk): HTMLElement {
  const input = h('input', { type: 'search', placeholder: 'Search nodes, elements, variables', 'aria-label': 'Search the model' });
  const tree = h('div', { class: 'tree' });
  const open = new Set<string>();
  let byPart = new Map<string, VariableInfo[]>();

  const draw = () => {
    const model = desk.shown.value?.model;
    tree.replaceChildren(...(model ? groups(model) : []));
  };

  const groups = (model: Model): HTMLElement[] => {
    const query = input.value.trim();
    const rows: HTMLElement[] = [];
    let left = MOST;
    const families = new Map<string, Part[]>();
    for (const part of [...model.nodes, ...model.elements, ...otherParts(model)]) {
      const family = part.id.startsWith('node.') ? `${part.family} nodes` : part.family;
      families.set(family, [...(families.get(family) ?? []), part]);
    }
    for (const [family, parts] of families) {
      const found = query ? parts.filter((part) => foundIn(part, query)) : parts;
      if (found.length === 0) continue;
      rows.push(h('div', { class: 'group' }, h('h2', {}, `${family} (${found.length})`)));
      const shown = found.slice(0, left);
      left -= shown.length;
      rows.push(h('ul', {}, ...shown.map((part) => partRow(part, query))));
      if (shown.length < found.length) rows.push(h('p', { class: 'soft group' }, `${found.length - shown.length} more: search for them`));
    }
    const own = (byPart.get('') ?? []).filter((variable) => !query || matches(variable.name, query));
    if (own.length > 0) rows.push(h('div', { class: 'group' }, h('h2', {}, 'model')), h('ul', { class: 'variables' }, ...own.map((variable) => variableRow(desk, variable))));
    return rows.length > 0 ? rows : [h('p', { class: 'soft group' }, 'Nothing is found.')];
  };

  const foundIn = (part: Part, query: string) =>
    matches(`${partTitle(part)} ${part.family}`, query) || (byPart.get(part.id) ?? []).some((variable) => matches(variable.name, query));

  const partRow = (part: Part, query: string): HTMLElement => {
    const variables = byPart.get(part.id) ?? [];
    const expanded = open.has(part.id) || (query !== '' && !matches(`${partTitle(part)} ${part.family}`, query));
    const twist = iconButton('play', `Variables of ${partTitle(part)}`, () => {
      if (!open.delete(part.id)) open.add(part.id);
      draw();
    }, { class: 'icon-button small twist', 'aria-expanded': String(expanded) });
    const row = h('div', { class: `row${desk.selected.value === part.id ? ' selected' : ''}` },
      variables.length > 0 ? twist : h('span', { class: 'twist' }),
      h('button', { type: 'button', class: 'name', onclick: () => (desk.selected.value = part.id) }, partTitle(part)));
    const shown = variables.filter((variable) => !query || matches(`${partTitle(part)} ${variable.name}`, query)).slice(0, 100);
    return h('li', {}, row, expanded && h('ul', { class: 'variables' }, ...shown.map((variable) => variableRow(desk, variable))));
  };

  input.addEventListener('input', draw);
  desk.shown.watch((shown) => {
    byPart = variablesByPart(shown?.model.variables ?? []);
    open.clear();
    input.value = '';
    draw();
  });
  desk.selected.watch(draw);
  return h('div', { class: 'pane' }, h('div', { class: 'search' }, input), tree);
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

