/** Reads the open lab from its page, as another program would: lessons know nothing else of the labs. */
import { labOf } from '../lab/address';

export type Value = number | string | boolean;

/** The open lab, as its page shows it. */
export interface LabReading {
  /** The lab's name in addresses. */
  lab: string;
  /** The lab's state; `running` also while a change is not in force yet, and what is shown is of the run before it. */
  state: string;
  /** Id of the open example; empty for the user's own file. */
  example: string;
  /** Parameters of the method, by their names in the package. */
  params: Record<string, Value>;
  /** Measures of the surface and `iteration`; area and volume only when they are those of the surface shown. */
  measures: Record<string, Value>;
  /** The warnings, in words. */
  warnings: string[];
}

const isValue = (value: unknown): value is Value => ['number', 'string', 'boolean'].includes(typeof value);

/** Reads what the lab in `root` shows. */
export function readLab(root: HTMLElement): LabReading {
  return {
    lab: labOf(location.hash) ?? '',
    state: root.dataset.changing === undefined ? (root.dataset.state ?? '') : 'running',
    example: root.querySelector<HTMLSelectElement>('.data select')?.value ?? '',
    params: paramsIn(root),
    measures: measuresIn(root),
    warnings: warningsIn(root),
  };
}

function warningsIn(root: HTMLElement): string[] {
  const shown = root.querySelector<HTMLElement>('[data-warning-list]')?.dataset.warningList ?? '[]';
  return JSON.parse(shown) as string[];
}

function measuresIn(root: HTMLElement): Record<string, Value> {
  const shown = root.querySelector<HTMLElement>('[data-measures]')?.dataset.measures ?? '{}';
  const entries = Object.entries(JSON.parse(shown) as Record<string, unknown>).filter(([, value]) => isValue(value));
  const measures = Object.fromEntries(entries) as Record<string, Value>;
  const digits = root.querySelector('.iteration')?.textContent?.replace(/\D/g, '');
  if (digits) measures.iteration = Number(digits);
  // While the model runs, the table keeps the area and volume of the last surface that was measured.
  if (!('closed' in measures)) for (const name of ['area', 'volume']) delete measures[name];
  return measures;
}

function paramsIn(root: HTMLElement): Record<string, Value> {
  const controls = root.querySelectorAll<HTMLElement>('[data-param]');
  const params = [...controls].flatMap((control): [string, Value][] => {
    const field = control.querySelector<HTMLInputElement | HTMLSelectElement>('select, input');
    return field ? [[control.dataset.param ?? '', valueIn(field)]] : [];
  });
  return { ...linkedParams(), ...Object.fromEntries(params) };
}

/** Returns the parameters in the page's address, among them those without a control of the usual kind. */
function linkedParams(): Record<string, Value> {
  const query = new URLSearchParams(location.hash.split(/\?(.*)/s)[1] ?? '');
  const entries = [...query].map(([name, value]): [string, Value] => [name.replace(/^p\./, ''), asNumber(value)]);
  return Object.fromEntries(entries);
}

function valueIn(field: HTMLInputElement | HTMLSelectElement): Value {
  return field instanceof HTMLInputElement && field.type === 'checkbox' ? field.checked : asNumber(field.value);
}

function asNumber(value: string): Value {
  return value !== '' && Number.isFinite(Number(value)) ? Number(value) : value;
}

/** Returns the label under which the lab shows a measure or parameter; its name if the lab does not show it. */
export function labelIn(root: HTMLElement, kind: 'measure' | 'param', name: string): string {
  const row = root.querySelector(`[data-${kind}="${CSS.escape(name)}"]`);
  const label = kind === 'measure' ? row?.previousElementSibling : row?.querySelector('label');
  return label?.textContent?.trim() || name;
}

/** Returns the name under which the lab offers an example; its id if it does not offer it. */
export function labelOfExample(root: HTMLElement, id: string): string {
  return root.querySelector(`.data select option[value="${CSS.escape(id)}"]`)?.textContent ?? id;
}

/**
 * Calls `callback`, at most once per animation frame, whenever what the lab in `root` shows may have changed, until
 * `signal` is aborted.
 */
export function watchLab(root: HTMLElement, signal: AbortSignal, callback: () => void): void {
  let pending = 0;
  const note = () => {
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(callback);
  };
  const watch = new MutationObserver(note);
  watch.observe(root, { subtree: true, attributeFilter: ['data-state', 'data-changing', 'data-measures'] });
  // A parameter that changes while the lab is paused.
  root.addEventListener('change', note, { signal });
  signal.addEventListener('abort', () => {
    watch.disconnect();
    cancelAnimationFrame(pending);
  });
}
