/** What is known of the selected node or element, and its values at the time looked at. */
import type { Desk } from '../desk';
import { h, iconButton } from '../dom';
import { componentName, number } from '../format';
import type { ElementShape } from '../geometry';
import { namedIn, otherParts, partTitle, shortName, variablesByPart, type Card, type Model, type VariableInfo } from '../model';
import { valueOf } from '../recording';

/** Variables whose values are followed while something is selected, and numbers of each. */
const MOST = 24, MOST_NUMBERS = 9;

/** What the scene can do about what is selected. */
export interface Looking {
  follow(id: string | undefined): void;
  lookAt(id: string | undefined): void;
}

export function selectionPanel(desk: Desk, scene: Looking): HTMLElement {
  const body = h('div', { class: 'inside' });
  const panel = h('details', { class: 'section', open: true }, h('summary', {}, h('h2', {}, 'Selection')), body);
  let cells: { variable: VariableInfo; cell: HTMLElement }[] = [];

  const rebuild = () => {
    cells = [];
    const model = desk.shown.value?.model, id = desk.selected.value;
    const part = model && [...model.nodes, ...model.elements, ...otherParts(model)].find((other) => other.id === id);
    if (!part || !model) return body.replaceChildren(h('p', { class: 'soft' }, 'Pick something in the scene or in the tree.'));
    const all = variablesByPart(model.variables).get(part.id) ?? [], variables = all.slice(0, MOST);
    desk.session?.want(variables);
    const shape = desk.shown.value?.geometry.elements.find((element) => element.id === id);
    const node = part.id.startsWith('node.structural:');
    body.replaceChildren(
      h('div', { class: 'row' }, h('strong', { class: 'name' }, partTitle(part)), h('span', { class: 'spacer' }),
        node || shape?.points.length ? iconButton('zoom', 'Look at it from near by (Z)', () => scene.lookAt(part.id)) : '',
        node ? iconButton('follow', 'Follow this node with the camera', () => scene.follow(part.id)) : '',
        iconButton('close', 'Select nothing', () => (desk.selected.value = undefined), { class: 'icon-button small' })),
      part.card ? cardText(part.card, model) : '',
      shape ? facts(shape, desk) : '',
      h('table', { class: 'values', 'aria-label': 'Variables' }, h('tbody', {}, ...variables.map(row))),
      all.length > MOST ? h('p', { class: 'soft' }, `${all.length - MOST} more variables: plot them from the tree`) : '',
    );
    update();
  };

  const row = (variable: VariableInfo): HTMLElement => {
    const cell = h('td');
    cells.push({ variable, cell });
    return h('tr', {}, h('th', { scope: 'row', title: variable.description }, shortName(variable.name), ' ', h('span', { class: 'soft' }, variable.unit)),
      cell, h('td', { class: 'tool' }, iconButton('plot', `Plot ${variable.name}`, () => desk.plot(variable), { class: 'icon-button small' })));
  };

  const update = () => {
    const sample = desk.sample;
    for (const { variable, cell } of cells) {
      const parts = Array.from({ length: Math.min(variable.size, MOST_NUMBERS) }, (_, k) => {
        const name = variable.size === 9 ? '' : componentName(variable.size, k);
        return h('span', { title: name }, number(sample ? valueOf(sample, variable.handle, k) : NaN, 4));
      });
      if (variable.size > MOST_NUMBERS) parts.push(h('span', { class: 'soft' }, `and ${variable.size - MOST_NUMBERS} more`));
      cell.replaceChildren(h('div', { class: variable.size === 9 ? 'numbers matrix' : 'numbers' }, ...parts));
    }
  };

  desk.selected.watch(rebuild);
  desk.shown.watch(rebuild);
  desk.calm.watch(update);
  return panel;
}

/** The card as the deck has it, and the deck's variables that it names. */
function cardText(card: Card, model: Model): HTMLElement {
  const parameters = namedIn(card, model.parameters);
  return h('figure', { class: 'written' },
    h('figcaption', { class: 'soft' }, card.place),
    h('pre', { tabindex: 0, 'aria-label': 'Card of the deck' }, card.text, card.cut ? h('span', { class: 'soft' }, '\n… the card goes on') : ''),
    parameters.length > 0 ? h('table', { class: 'values', 'aria-label': 'Parameters' }, h('tbody', {}, ...parameters.map(({ name, value }) =>
      h('tr', {}, h('th', { scope: 'row' }, h('code', {}, name)), h('td', {}, value))))) : '');
}

/** What the deck says of an element's shape. */
function facts(shape: ElementShape, desk: Desk): HTMLElement {
  const nodes = desk.shown.value?.geometry.nodes ?? [];
  const rows: [string, string][] = [];
  for (const mass of shape.masses) rows.push(['mass', number(mass.mass)], ['principal moments', mass.moments.map((J) => number(J, 4)).join('  ')]);
  for (const point of shape.points) {
    const where = point.node < 0 ? 'fixed' : `node ${nodes[point.node]?.label ?? '?'}`;
    rows.push([point.name || 'point', `${where}  (${point.offset.map((x) => number(x, 4)).join(', ')})`]);
  }
  return h('table', { class: 'values' }, h('tbody', {}, ...rows.slice(0, 12).map(([name, text]) => h('tr', {}, h('th', { scope: 'row' }, name), h('td', {}, text)))));
}

