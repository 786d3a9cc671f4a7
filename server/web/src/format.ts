/** Numbers and names as people read them. */

/** About `digits` significant digits, without trailing zeros; a power of ten only where it helps. */
export function number(value: number, digits = 5): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? '–' : value > 0 ? '∞' : '−∞';
  if (value === 0) return '0';
  const size = Math.abs(value);
  const text = size >= 10 ** Math.max(6, digits) || size < 1e-4 ? value.toExponential(digits - 1) : value.toPrecision(digits);
  return text.replace(/(\.\d*?)0+(e|$)/, '$1$2').replace(/\.(e|$)/, '$1').replaceAll('-', '−');
}

/** The number that a text says; NaN: none, or it can be read in two ways. */
export function numberOf(text: string): number {
  const plain = text.trim().replace('−', '-');
  return /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) && Number.isFinite(Number(plain)) ? Number(plain) : NaN;
}

/** A number as a field has it: it can be read again. */
export function editable(value: number, digits: number): string {
  return number(value, digits).replaceAll('−', '-');
}

/** Digits with which numbers up to `largest` that are `increment` apart differ; at least `least`. */
function digitsOf(largest: number, increment: number, least: number): number {
  const digits = Math.floor(Math.log10(Math.max(largest, increment))) - Math.floor(Math.log10(increment)) + 2;
  return Number.isFinite(digits) ? Math.min(Math.max(digits, least), 16) : least;
}

/** Numbers beside an axis, on which `10 ** power` is one. */
export function ticks(values: readonly number[], increment: number, power = 0): string[] {
  const digits = digitsOf(Math.max(...values.map(Math.abs)), increment, 4);
  return values.map((value) => (power === 0 ? number(value, digits) : withPower(value, digits, power)));
}

/** `value` times a power of ten that it may not have room for. */
function withPower(value: number, digits: number, power: number): string {
  const [mantissa, exponent] = value.toExponential(digits - 1).split('e');
  return value === 0 ? '0' : `${number(Number(mantissa), digits)}e${Number(exponent) + power < 0 ? '−' : '+'}${Math.abs(Number(exponent) + power)}`;
}

/** A time; those of steps, `step` apart, differ. */
export function clock(time: number, step: number): string {
  return `${number(time, digitsOf(Math.abs(time), step, 6))} s`;
}

export function seconds(value: number): string {
  if (!Number.isFinite(value)) return number(value);
  const size = Math.abs(value);
  if (size > 0 && size < 1e-3) return `${number(value * 1e6, 3)} µs`;
  if (size > 0 && size < 1) return `${number(value * 1e3, 3)} ms`;
  return `${number(value, 4)} s`;
}

export function bytes(count: number): string {
  if (count < 1024) return `${count} B`;
  const units = ['KiB', 'MiB', 'GiB'];
  let size = count, unit = -1;
  while (size >= 1024 && unit < units.length - 1) size /= 1024, ++unit;
  return `${number(size, 3)} ${units[unit]}`;
}

const COMPONENTS: Record<number, string[]> = {
  3: ['x', 'y', 'z'],
  6: ['fx', 'fy', 'fz', 'mx', 'my', 'mz'],
  9: ['11', '12', '13', '21', '22', '23', '31', '32', '33'],
};

/** "x" for the first of three numbers; "" for a scalar. */
export function componentName(size: number, element: number): string {
  return size === 1 ? '' : COMPONENTS[size]?.[element] ?? String(element + 1);
}

/** "N" for a force, "N m" for a moment of "N, N m". */
export function unitOf({ unit, size }: { unit: string; size: number }, element: number): string {
  const units = unit.split(', ');
  return units[Math.floor((element * units.length) / size)];
}

/** "X.y": the end of a variable's name and the component. */
export function curveName(variable: string, size: number, element: number): string {
  const component = componentName(size, element);
  return component ? `${variable}.${component}` : variable;
}
