/** What happened, newest last. */
import type { Desk } from '../desk';
import { h, oncePerFrame } from '../dom';
import type { LogEntry } from '../session';
import { section } from './section';

export function logPanel(desk: Desk): HTMLElement {
  const list = h('div', { class: 'log', role: 'log', 'aria-live': 'polite', tabindex: 0, 'aria-label': 'Events' });
  const panel = section('Events', false, list);
  const rows = new Map<LogEntry, HTMLElement>();
  let unwatch = () => {};

  /** What stays is not touched: it may be selected, and is read aloud once. */
  const draw = () => {
    const atEnd = list.scrollHeight - list.scrollTop - list.clientHeight < 4;  // otherwise somebody reads what was before
    const entries = new Set(desk.session?.log.value);
    for (const [entry, row] of rows) {
      if (entries.has(entry)) continue;
      row.remove();
      rows.delete(entry);
    }
    for (const entry of entries) {
      if (rows.has(entry)) continue;
      const row = h('div', { class: entry.level }, h('span', { class: 'soft' }, moment(entry.wall)), ' ', entry.text);
      rows.set(entry, row);
      list.append(row);
    }
    if (atEnd) list.scrollTop = list.scrollHeight;
  };

  const drawSoon = oncePerFrame(draw);  // many may come at once
  desk.shown.watch(() => {
    unwatch();
    panel.classList.toggle('hidden', !desk.session);
    unwatch = desk.session?.log.watch(drawSoon) ?? (() => {});
  });
  return panel;
}

/** Time of day; with its date where that was another day. */
export function moment(wall: Date, now = new Date()): string {
  return wall.toDateString() === now.toDateString() ? wall.toLocaleTimeString() : wall.toLocaleString();
}
