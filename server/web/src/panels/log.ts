/** What happened, newest last. */
import type { Desk } from '../desk';
import { h } from '../dom';
import { section } from './section';

export function logPanel(desk: Desk): HTMLElement {
  const list = h('div', { class: 'log', role: 'log', 'aria-live': 'polite', tabindex: 0, 'aria-label': 'Events' });
  const panel = section('Events', false, list);
  let unwatch = () => {};
  desk.shown.watch(() => {
    unwatch();
    panel.classList.toggle('hidden', !desk.session);
    unwatch = desk.session?.log.watch((entries) => {
      list.replaceChildren(...entries.map((entry) => h('div', { class: entry.level }, h('span', { class: 'soft' }, entry.wall.toLocaleTimeString()), ' ', entry.text)));
      list.scrollTop = list.scrollHeight;
    }) ?? (() => {});
  });
  return panel;
}
