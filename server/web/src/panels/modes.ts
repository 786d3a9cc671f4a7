/** Eigenmodes about the present state: a list to animate. */
import type { Desk } from '../desk';
import { h, icon, numberField, numberIn } from '../dom';
import { number } from '../format';
import { damping, frequency, type Mode } from '../modes';
import { section } from './section';

/** Parts of the critical damping that are smaller are rounding. */
const NO_DAMPING = 1e-11;

export function modesPanel(desk: Desk, animate: (mode: Mode | undefined, size: number) => void): HTMLElement {
  const count = h('input', { type: 'number', min: 1, max: 200, value: '10', 'aria-label': 'Number of eigenvalues', style: 'width:70px' });
  const near = numberField({ inputmode: 'decimal', value: '1', 'aria-label': 'Nearest to this frequency, in hertz', style: 'width:70px' });
  const size = h('input', { type: 'range', min: 0.02, max: 0.5, step: 0.01, value: '0.12', 'aria-label': 'Size of the motion' });
  const list = h('ul', { class: 'list' });
  const compute = h('button', { type: 'button', class: 'button', onclick: () => void run() }, icon('wave'), 'Compute');
  const panel = section('Eigenmodes', false, h('div', { class: 'legend' }, count, h('span', { class: 'soft' }, 'nearest to'), near, h('span', { class: 'soft' }, 'Hz'), compute), size, list);
  let buttons = new Map<Mode, HTMLElement>(), computing = false;
  let shown: Mode | undefined;

  /** The button keeps the focus while it does nothing. */
  const run = async () => {
    const { session } = desk, hertz = numberIn(near);
    if (!session || computing || Number.isNaN(hertz)) return;
    computing = true;
    compute.setAttribute('aria-disabled', 'true');
    show(undefined);
    const found = await session.eigenmodes(count.valueAsNumber || 10, hertz);
    computing = false;
    compute.setAttribute('aria-disabled', 'false');
    if (session === desk.session) draw(found);
  };

  const show = (mode: Mode | undefined) => {
    shown = mode;
    animate(mode, size.valueAsNumber);
    for (const [other, button] of buttons) {
      button.classList.toggle('current', other === mode);
      button.setAttribute('aria-pressed', String(other === mode));
    }
  };

  const draw = (modes: readonly Mode[]) => {
    buttons = new Map(modes.map((mode) => [mode, h('button', { type: 'button', class: 'card', 'aria-pressed': 'false', onclick: () => show(mode === shown ? undefined : mode) },
      h('span', { class: 'number' }, `${number(frequency(mode), 5)} Hz`), h('span', { class: 'spacer' }), h('span', { class: 'soft number' }, `damping ${number(Math.abs(damping(mode)) < NO_DAMPING ? 0 : 100 * damping(mode), 3)} %`))]));
    list.replaceChildren(...[...buttons.values()].map((button) => h('li', {}, button)));
  };

  size.addEventListener('input', () => animate(shown, size.valueAsNumber));
  desk.shown.watch(() => {
    draw([]);
    show(undefined);
    panel.classList.toggle('hidden', !desk.session);
  });
  return panel;
}
