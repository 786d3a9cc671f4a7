/** Saved states: go back, branch off, forget. */
import type { Desk } from '../desk';
import { h, icon, iconButton } from '../dom';
import { bytes, clock } from '../format';
import { section } from './section';

export function snapshotsPanel(desk: Desk, open: (simulation: string) => void): HTMLElement {
  const list = h('ul', { class: 'list' });
  const save = h('button', { type: 'button', class: 'button', onclick: () => void desk.session?.saveSnapshot('') }, icon('save'), 'Save state');
  const fork = h('button', { type: 'button', class: 'button', onclick: () => void branch() }, icon('branch'), 'Branch off here');
  const panel = section('Snapshots', true, h('div', { class: 'legend' }, save, fork), list);
  let unwatch = () => {};

  const branch = async (snapshot?: Parameters<NonNullable<typeof desk.session>['branch']>[0]) => {
    const session = desk.session;
    const name = await session?.branch(snapshot, `${session.title} (branch)`);
    if (name) open(name);
  };

  desk.shown.watch(() => {
    unwatch();
    const session = desk.session;
    panel.classList.toggle('hidden', !session);
    unwatch = session
      ? session.snapshots.watch((snapshots) => list.replaceChildren(...snapshots.map((snapshot) => h('li', { class: 'card' },
          h('div', { class: 'body' }, h('div', {}, `${clock(snapshot.time, session.model.step)}`), h('div', { class: 'soft' }, `step ${snapshot.step}, ${bytes(Number(snapshot.sizeBytes))}`)),
          iconButton('restore', `Restore the state at ${clock(snapshot.time, session.model.step)}`, () => void session.restore(snapshot)),
          iconButton('branch', `Branch off at ${clock(snapshot.time, session.model.step)}`, () => void branch(snapshot)),
          iconButton('trash', `Delete the state at ${clock(snapshot.time, session.model.step)}`, () => void session.deleteSnapshot(snapshot))))))
      : () => {};
  });
  return panel;
}
