import { h } from '../dom';

/** A part of the right-hand side that folds. */
export function section(title: string, open: boolean, ...inside: (Node | string)[]): HTMLDetailsElement {
  return h('details', { class: 'section', open }, h('summary', {}, h('h2', {}, title)), h('div', { class: 'inside' }, ...inside));
}
