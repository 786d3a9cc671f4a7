/** Elements of the document in one expression each. */
import { numberOf } from './format';

type Child = Node | string | number | null | undefined | false;
type Attributes = Record<string, unknown>;

/** `on…` are listeners, `class` and all others attributes; `false` and `undefined` leave one out. */
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value as EventListener);
    else if (name === 'value' || name === 'checked' || name === 'disabled') (element as unknown as Attributes)[name] = value;
    else element.setAttribute(name, value === true ? '' : String(value));
  }
  for (const child of children) if (child !== null && child !== undefined && child !== false) element.append(typeof child === 'number' ? String(child) : child);
  return element;
}

export function replace(parent: Element, ...children: Child[]): void {
  parent.replaceChildren(...children.filter((child): child is Node | string => child instanceof Node || typeof child === 'string'));
}

/** A field for a number. (Browsers read "1,5" as 15 where a field has `type="number"`.) */
export function numberField(attributes: Attributes): HTMLInputElement {
  const field = h('input', { type: 'text', autocomplete: 'off', spellcheck: 'false', class: 'number', ...attributes });
  field.addEventListener('input', () => field.setCustomValidity(''));
  return field;
}

/** The field's number; NaN: it has none, and says so unless it is empty. */
export function numberIn(field: HTMLInputElement): number {
  const { value } = field, found = numberOf(value);
  if (Number.isNaN(found) && value.trim() !== '') complain(field, `"${value}" is no number. Numbers are written like 1.5 or 2e-3.`);
  return found;
}

/** Says at a field what is wrong with it, until it is changed. */
export function complain(field: HTMLInputElement, what: string): void {
  field.setCustomValidity(what);
  field.reportValidity();
}

/** Makes these the children of `parent`. What stays is not touched: it may have the focus, or be pressed. Where what goes had the focus, `parent` gets it. */
export function arrange(parent: HTMLElement, children: readonly Element[]): void {
  const staying = new Set(children), focused = parent.contains(document.activeElement);
  for (const child of [...parent.children]) if (!staying.has(child)) child.remove();
  children.forEach((child, place) => child !== parent.children[place] && parent.insertBefore(child, parent.children[place] ?? null));
  if (!focused || parent.contains(document.activeElement)) return;
  parent.tabIndex = -1;
  parent.focus();
}

/** Asks for `work` with the next frame of the screen, however often it is called until then; true: it was not asked for yet. */
export function oncePerFrame(work: () => void): () => boolean {
  let asked = false;
  return () => {
    if (asked) return false;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      work();
    });
    return true;
  };
}

/** Paths of a 24 × 24 drawing, stroked in the text's colour. */
const ICONS: Record<string, string> = {
  play: 'M7 5l12 7-12 7z',
  pause: 'M8 5v14M16 5v14',
  step: 'M6 5l9 7-9 7zM18 5v14',
  fast: 'M4 6l8 6-8 6zM12 6l8 6-8 6z',
  until: 'M4 12h13M13 8l4 4-4 4M20 5v14',
  save: 'M6 4h12v16l-6-4-6 4z',
  restore: 'M4 9h10a5 5 0 010 10H8M8 5L4 9l4 4',
  branch: 'M7 4v16M7 14c8 0 10-2 10-6M14 8l3-3 3 3',
  trash: 'M5 7h14M9 7V4h6v3M7 7l1 13h8l1-13',
  plot: 'M4 4v16h16M7 15l4-5 3 3 5-7',
  plus: 'M12 5v14M5 12h14',
  close: 'M6 6l12 12M18 6L6 18',
  fit: 'M4 9V4h5M20 9V4h-5M4 15v5h5M20 15v5h-5',
  zoom: 'M10 4a6 6 0 100 12 6 6 0 000-12zM15 15l5 5M10 7v6M7 10h6',
  camera: 'M4 8h4l2-3h4l2 3h4v11H4zM12 16a3 3 0 100-6 3 3 0 000 6',
  theme: 'M12 4a8 8 0 108 8 6 6 0 01-8-8z',
  help: 'M9 9a3 3 0 115 2c-1 1-2 1.5-2 3M12 17.5v.5',
  search: 'M10 4a6 6 0 100 12 6 6 0 000-12zM15 15l5 5',
  download: 'M12 4v11M7 11l5 5 5-5M5 20h14',
  upload: 'M12 20V9M7 13l5-5 5 5M5 4h14',
  layers: 'M12 4l9 5-9 5-9-5zM3 14l9 5 9-5',
  follow: 'M12 3v4M12 17v4M3 12h4M17 12h4M12 15a3 3 0 100-6 3 3 0 000 6',
  eye: 'M2 12s4-6 10-6 10 6 10 6-4 6-10 6-10-6-10-6zM12 15a3 3 0 100-6 3 3 0 000 6',
  wave: 'M3 12c3-10 6-10 9 0s6 10 9 0',
  loop: 'M17 4l3 3-3 3M20 7H8a4 4 0 00-4 4M7 20l-3-3 3-3M4 17h12a4 4 0 004-4',
  list: 'M8 6h12M8 12h12M8 18h12M4 6h.01M4 12h.01M4 18h.01',
};

export function icon(name: string): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  for (const [key, value] of Object.entries({ viewBox: '0 0 24 24', 'aria-hidden': 'true', class: `icon icon-${name}` })) svg.setAttribute(key, value);
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', ICONS[name] ?? '');
  svg.append(path);
  return svg;
}

/** A button with an icon and a name that is spoken, and shown as a hint. */
export function iconButton(name: string, label: string, action: () => void, attributes: Attributes = {}): HTMLButtonElement {
  return h('button', { type: 'button', class: 'icon-button', title: label, 'aria-label': label, onclick: action, ...attributes }, icon(name));
}

/** Calls a button with an icon something else. */
export function rename(button: Element, label: string): void {
  for (const attribute of ['title', 'aria-label']) if (button.getAttribute(attribute) !== label) button.setAttribute(attribute, label);
}

/** Offers `data` as a file. */
export function download(name: string, data: Blob): void {
  const address = URL.createObjectURL(data);
  const link = h('a', { href: address, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
