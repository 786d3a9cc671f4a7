/** Sliders for what clients may write: loads on nodes, drives of streams, parameters. */
import type { Desk } from '../desk';
import { h, numberField, numberIn } from '../dom';
import { curveName, editable, unitOf } from '../format';
import { finder, partOf, type VariableInfo } from '../model';
import { valueOf } from '../recording';
import { section } from './section';

/** Variables, and numbers of one of them, that are shown. */
const MOST = 12, MOST_NUMBERS = 24;
const WRITE_MILLISECONDS = 40;

export function inputsPanel(desk: Desk): HTMLElement {
  const search = h('input', { type: 'search', placeholder: 'Search inputs', 'aria-label': 'Search inputs' });
  const rows = h('div', { class: 'inside', style: 'padding:0' });
  const panel = section('Inputs', false, search, rows);
  let shown: { variable: VariableInfo; set: (values: number[]) => void }[] = [];

  const inputs = (): VariableInfo[] =>
    (desk.shown.value?.model.variables ?? []).filter((variable) => variable.kind === 'input' || variable.kind === 'parameter');

  const rebuild = () => {
    shown = [];
    const all = inputs(), selected = desk.selected.value, query = search.value.trim(), matches = finder(query);
    const found = all.filter((variable) => (query ? matches(`${variable.name} ${variable.description}`) : !selected || partOf(variable.name) === selected));
    const list = found.length > 0 || query ? found : all;
    panel.classList.toggle('hidden', all.length === 0 || !desk.session);
    if (!panel.open) return rows.replaceChildren();
    desk.session?.want(list.slice(0, MOST));
    rows.replaceChildren(...list.slice(0, MOST).map(row), list.length > MOST ? h('p', { class: 'soft' }, `${list.length - MOST} more: search, or select their node`) : '');
    update();
  };

  const row = (variable: VariableInfo): HTMLElement => {
    const count = Math.min(variable.size, MOST_NUMBERS);
    const values = new Array<number>(variable.size).fill(0);
    const fields: { slider: HTMLInputElement; field: HTMLInputElement }[] = [];
    const unwritten = new Map<number, number>();  // what samples that are on their way do not know yet
    let timer = 0;
    const write = (k: number, value: number) => {
      if (!Number.isFinite(value)) return;
      unwritten.set(k, value);
      clearTimeout(timer);
      timer = window.setTimeout(async () => {
        const sent = [...unwritten];
        for (const [place, wanted] of sent) values[place] = wanted;
        await desk.session?.write(variable, [...values]);
        for (const [place, wanted] of sent) if (unwritten.get(place) === wanted) unwritten.delete(place);
        update();  // what was refused is not there
      }, WRITE_MILLISECONDS);
    };
    const lines = Array.from({ length: count }, (_, k) => {
      const name = curveName(variable.name.replace('node.structural.', 'node '), variable.size, k);
      const slider = h('input', { type: 'range', min: -10, max: 10, step: 'any', value: 0, disabled: true, 'aria-label': name });
      const field = numberField({ disabled: true, 'aria-label': `${name}, value` });
      slider.addEventListener('input', () => {
        field.value = editable(slider.valueAsNumber, 4);
        write(k, slider.valueAsNumber);
      });
      field.addEventListener('change', () => {
        const value = numberIn(field);
        if (Number.isNaN(value)) return;
        widen(slider, value);
        slider.value = String(value);
        write(k, value);
      });
      field.addEventListener('blur', () => {
        field.setCustomValidity('');
        field.value = editable(unwritten.get(k) ?? values[k], 6);
      });
      fields.push({ slider, field });
      return h('div', { class: 'input' }, h('span', { class: 'label', title: variable.description }, name, ' ', h('span', { class: 'soft' }, unitOf(variable, k))), slider, field);
    });
    shown.push({
      variable,
      set: (next) => next.forEach((value, k) => {
        if (unwritten.has(k)) return;
        values[k] = value;
        if (k >= count) return;
        const { slider, field } = fields[k];
        slider.disabled = field.disabled = false;  // from when on its numbers are known
        if (document.activeElement === slider || document.activeElement === field) return;
        widen(slider, value);
        slider.value = String(value);
        field.value = editable(value, 6);
      }),
    });
    return h('div', {}, ...lines, count < variable.size ? h('p', { class: 'soft' }, `${variable.size - count} more numbers of ${variable.name} are not shown`) : '');
  };

  const update = () => {
    const sample = desk.shown.value?.recording.last;
    if (!sample || !panel.open) return;
    for (const { variable, set } of shown) {
      const values = Array.from({ length: variable.size }, (_, k) => valueOf(sample, variable.handle, k));
      if (values.every(Number.isFinite)) set(values);
    }
  };

  search.addEventListener('input', rebuild);
  panel.addEventListener('toggle', rebuild);
  desk.shown.watch(rebuild);
  desk.selected.watch(rebuild);
  desk.calm.watch(update);
  return panel;
}

/** A slider reaches ten times as far once its value is out of its range. */
function widen(slider: HTMLInputElement, value: number): void {
  let reach = Number(slider.max);
  while (Number.isFinite(value) && Math.abs(value) > reach) reach *= 10;
  slider.max = String(reach);
  slider.min = String(-reach);
}
