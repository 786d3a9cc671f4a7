/** The model as a tree with search: nodes, elements, and their variables. One stop of the Tab key; arrows walk it. */
import type { Desk } from '../desk';
import { h, icon, iconButton } from '../dom';
import { finder, otherParts, partTitle, shortName, variablesByPart, type Model, type Part, type VariableInfo } from '../model';

/** Parts, and variables of one of them, at once; a search finds the rest. */
const MOST = 400, MOST_VARIABLES = 100;

/** What an item of the tree does when it is chosen. */
interface Item {
  act(): void;
  /** Shows what is in it, or hides that. */
  expand?(on: boolean): void;
}

export function treePanel(desk: Desk): HTMLElement {
  const input = h('input', { type: 'search', placeholder: 'Search nodes, elements, variables', 'aria-label': 'Search the model' });
  const tree = h('ul', { class: 'tree', role: 'tree', 'aria-label': 'Nodes, elements, variables' });
  const none = h('p', { class: 'soft group', role: 'status' });
  const open = new Set<string>(), closed = new Set<string>();
  let items = new Map<Element, Item>();
  let byPart: ReadonlyMap<string, VariableInfo[]> = new Map(), families = new Map<string, Part[]>();
  let rows = new Map<string, HTMLElement>(), marked: HTMLElement | undefined;
  /** The item that the Tab key leads to. */
  let current: HTMLElement | undefined;

  const draw = () => {
    rows = new Map();
    items = new Map();
    tree.replaceChildren(...(desk.shown.value ? groups() : []));
    tree.classList.toggle('hidden', items.size === 0);
    none.textContent = desk.shown.value && items.size === 0 ? 'Nothing is found.' : '';
    mark();
    turnTo(marked ?? visible()[0]);
  };

  /** Nothing else is touched when something is selected: it may have the focus. */
  const mark = () => {
    const row = rows.get(desk.selected.value ?? '');
    marked?.setAttribute('aria-selected', 'false');
    row?.setAttribute('aria-selected', 'true');
    marked = row;
  };

  // ---- what is in it

  const groups = (): HTMLElement[] => {
    const query = input.value.trim(), matches = finder(query);
    const drawn: HTMLElement[] = [];
    let left = MOST;
    for (const [family, parts] of families) {
      const titled = (part: Part) => matches(`${partTitle(part)} ${part.family}`);
      const found = query ? parts.filter((part) => titled(part) || (byPart.get(part.id) ?? []).some((variable) => matches(variable.name))) : parts;
      if (found.length === 0) continue;
      const shown = found.slice(0, left);
      left -= shown.length;
      drawn.push(familyItem(family, `${family} (${found.length})`, () => [...shown.map((part) => partItem(part, matches, query !== '' && !titled(part))), ...rest(found.length - shown.length, 2)]));
    }
    const own = (byPart.get('') ?? []).filter((variable) => matches(variable.name));
    if (own.length > 0) drawn.push(familyItem('', 'model', () => own.map((variable) => variableItem(variable, 2))));
    return drawn;
  };

  const familyItem = (family: string, title: string, content: () => HTMLElement[]): HTMLElement => {
    const element = branch(title, 1, [h('span', { class: 'name' }, title)], content, (on) => void (on ? closed.delete(family) : closed.add(family)), input.value.trim() !== '' || !closed.has(family));
    return withAct(element, () => toggle(element));
  };

  const partItem = (part: Part, matches: (text: string) => boolean, found: boolean): HTMLElement => {
    const title = partTitle(part), content = h('span', { class: 'name' }, title);
    const variables = (byPart.get(part.id) ?? []).filter((variable) => matches(`${title} ${variable.name}`));
    const inside = () => [...variables.slice(0, MOST_VARIABLES).map((variable) => variableItem(variable, 3)), ...rest(variables.length - MOST_VARIABLES, 3)];
    const element = variables.length > 0
      ? branch(title, 2, [content], inside, (on) => void (on ? open.add(part.id) : open.delete(part.id)), found || open.has(part.id))
      : leaf(title, 2, content);
    element.setAttribute('aria-selected', 'false');
    rows.set(part.id, element);
    return withAct(element, () => (desk.selected.value = part.id));
  };

  const variableItem = (variable: VariableInfo, level: number): HTMLElement => {
    const name = shortName(variable.name), title = variable.size > 1 ? `${name} [${variable.size}]` : name;
    const about = [variable.description, variable.frame && `${variable.frame} frame`, variable.kind].filter(Boolean).join(', ');
    const plot = () => desk.plot(variable);
    const element = leaf(`${title} ${variable.unit}: plot`, level, h('span', { class: 'name' }, title), h('span', { class: 'unit' }, variable.unit),
      iconButton('plot', `Plot ${variable.name}`, plot, { class: 'icon-button small', tabindex: -1 }));
    element.title = `${variable.name}: ${about}`;
    return withAct(element, plot);
  };

  /** Says what is left out. */
  const rest = (count: number, level: number): HTMLElement[] =>
    count > 0 ? [withAct(leaf(`${count} more: search for them`, level, h('span', { class: 'name soft' }, `${count} more: search for them`)), () => input.focus())] : [];

  const leaf = (title: string, level: number, ...content: Node[]): HTMLElement =>
    h('li', { role: 'treeitem', 'aria-label': title, 'aria-level': level, tabindex: -1 }, h('div', { class: 'row' }, h('span', { class: 'twist' }), ...content));

  /** `content` is made when it is shown; `told` of each change. */
  const branch = (title: string, level: number, row: Node[], content: () => HTMLElement[], told: (on: boolean) => void, on: boolean): HTMLElement => {
    const element = leaf(title, level, ...row), list = h('ul', { role: 'group' });
    element.querySelector('.twist')?.append(icon('play'));
    const expand = (wanted: boolean) => {
      element.setAttribute('aria-expanded', String(wanted));
      if (!wanted && current && list.contains(current)) turnTo(element, list.contains(document.activeElement));
      list.querySelectorAll('[role=treeitem]').forEach((gone) => items.delete(gone));
      list.replaceChildren(...(wanted ? content() : []));
      mark();
    };
    items.set(element, { act: () => {}, expand: (wanted) => (told(wanted), expand(wanted)) });
    expand(on);
    element.append(list);
    return element;
  };

  const withAct = (element: HTMLElement, act: () => void): HTMLElement => {
    items.set(element, { ...items.get(element), act });
    return element;
  };

  // ---- walking

  const toggle = (element: HTMLElement) => items.get(element)?.expand?.(element.getAttribute('aria-expanded') !== 'true');

  const visible = (): HTMLElement[] => [...tree.querySelectorAll<HTMLElement>('[role=treeitem]')];

  const turnTo = (element: HTMLElement | undefined, focus = false) => {
    if (current) current.tabIndex = -1;
    current = element;
    if (!element) return;
    element.tabIndex = 0;
    if (!focus) return;
    element.focus({ preventScroll: true });
    element.firstElementChild?.scrollIntoView({ block: 'nearest' });
  };

  const itemOf = (target: EventTarget | null) => (target as Element | null)?.closest<HTMLElement>('[role=treeitem]') ?? undefined;

  const walk = (by: number) => {
    const all = visible(), at = all.indexOf(current as HTMLElement) + by;
    if (at >= 0 && at < all.length) turnTo(all[at], true);
  };

  const inward = (element: HTMLElement) => {
    if (element.getAttribute('aria-expanded') === 'false') toggle(element);
    else if (element.getAttribute('aria-expanded') === 'true') walk(1);
  };

  const outward = (element: HTMLElement) => {
    if (element.getAttribute('aria-expanded') === 'true') toggle(element);
    else turnTo(itemOf(element.parentElement) ?? element, true);
  };

  const keys: Record<string, (element: HTMLElement) => void> = {
    ArrowDown: () => walk(1),
    ArrowUp: () => walk(-1),
    ArrowRight: inward,
    ArrowLeft: outward,
    Home: () => turnTo(visible()[0], true),
    End: () => turnTo(visible().at(-1), true),
    Enter: (element) => items.get(element)?.act(),
    ' ': (element) => items.get(element)?.act(),
  };

  tree.addEventListener('keydown', (event) => {
    const element = itemOf(event.target), key = keys[event.key];
    if (!element || !key || event.ctrlKey || event.metaKey || event.altKey || (event.target as Element).closest('button')) return;
    key(element);
    event.preventDefault();
    event.stopPropagation();  // they mean other things to the page
  });
  tree.addEventListener('click', (event) => {
    const element = itemOf(event.target), target = event.target as Element;
    if (!element || !target.closest('.row')) return;
    turnTo(element, !target.closest('button'));
    if (target.closest('.twist')) toggle(element);
    else if (!target.closest('button')) items.get(element)?.act();
  });
  input.addEventListener('keydown', (event) => {
    if (event.key !== 'ArrowDown') return;
    event.preventDefault();
    turnTo(current, true);
  });

  input.addEventListener('input', draw);
  desk.shown.watch((shown) => {
    byPart = variablesByPart(shown?.model.variables ?? []);
    families = shown ? byFamily(shown.model) : new Map();
    open.clear();
    closed.clear();
    input.value = '';
    draw();
  });
  desk.selected.watch(mark);
  return h('div', { class: 'pane' }, h('div', { class: 'search' }, input), tree, none);
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
