/** Saved states: go back, branch off, forget. */
import type { Desk } from '../desk';
import { arrange, h, icon, iconButton } from '../dom';
import { bytes, clock } from '../format';
import type { Snapshot } from '../gen/mbcosim/v1/simulations_pb';
import type { Session } from '../session';
import { section } from './section';

export function snapshotsPanel(desk: Desk, open: (simulation: string) => void): HTMLElement {
  const list = h('ul', { class: 'list' });
  const save = h('button', { type: 'button', class: 'button', onclick: () => void desk.session?.saveSnapshot('') }, icon('save'), 'Save state');
  const fork = h('button', { type: 'button', class: 'button', onclick: () => void branch() }, icon('branch'), 'Branch off here');
  const reset = h('button', { type: 'button', class: 'button', onclick: () => void desk.session?.reset() }, icon('restore'), 'Back to the start');
  const panel = section('Snapshots', true, h('div', { class: 'legend' }, save, fork, reset), list);
  let unwatch = () => {};

  const branch = async (snapshot?: Snapshot) => {
    const session = desk.session;
    const name = await session?.branch(snapshot, `${session.title} (branch)`);
    if (name) open(name);
  };

  const row = (session: Session, snapshot: Snapshot): HTMLElement => {
    const time = clock(snapshot.time, session.model.step);
    return h('li', { class: 'card' },
      h('div', { class: 'body' }, h('div', {}, time), h('div', { class: 'soft' }, `step ${snapshot.step}, ${bytes(Number(snapshot.sizeBytes))}`)),
      iconButton('restore', `Restore the state at ${time}`, () => void session.restore(snapshot)),
      iconButton('branch', `Branch off at ${time}`, () => void branch(snapshot)),
      iconButton('trash', `Delete the state at ${time}`, () => void session.deleteSnapshot(snapshot)));
  };

  desk.shown.watch(() => {
    unwatch();
    const session = desk.session;
    panel.classList.toggle('hidden', !session);
    const rows = new Map<string, HTMLElement>();
    unwatch = session?.snapshots.watch((snapshots) => arrange(list, snapshots.map((snapshot) => {
      const shown = rows.get(snapshot.name) ?? row(session, snapshot);
      rows.set(snapshot.name, shown);
      return shown;
    }))) ?? (() => {});
  });
  return panel;
}
