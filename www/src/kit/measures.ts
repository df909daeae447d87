import type { Measures, StepReport, Unit } from '../engine/protocol';
import { text } from '../texts';
import { h } from './dom';
import { count, figure, lengths } from './format';

/**
 * Measures shown for every surface, also available to other programs as JSON in the element's `data-measures`.
 * `crossings` is the number of crossing pairs of triangles.
 */
export interface MeasureValues {
  vertices: number;
  triangles: number;
  components: number;
  chi: number;
  genus: number;
  volume: number;
  area: number;
  closed: boolean;
  oriented: boolean;
  crossings: number;
}
type Name = keyof MeasureValues;

const ROWS: { name: Name; label: string; help: string }[] = [
  { name: 'vertices', label: text('measures.vertices'), help: text('measures.verticesHelp') },
  { name: 'triangles', label: text('measures.triangles'), help: text('measures.trianglesHelp') },
  { name: 'components', label: text('measures.components'), help: text('measures.componentsHelp') },
  { name: 'genus', label: text('measures.genus'), help: text('measures.genusHelp') },
  { name: 'chi', label: text('measures.euler'), help: text('measures.eulerHelp') },
  { name: 'volume', label: text('measures.volume'), help: text('measures.volumeHelp') },
  { name: 'area', label: text('measures.area'), help: text('measures.areaHelp') },
  {
    name: 'closed',
    label: text('measures.closed'),
    help: text('measures.closedHelp'),
  },
  {
    name: 'oriented',
    label: text('measures.oriented'),
    help: text('measures.orientedHelp'),
  },
  {
    name: 'crossings',
    label: text('measures.selfIntersections'),
    help: text('measures.selfIntersectionsHelp'),
  },
];

/** A measure that only one lab has, with the texts of its row in the table. */
export interface ExtraMeasure {
  name: string;
  label: string;
  help: string;
  text: (value: number) => string;
  /** Whether the row is hidden while the value is unknown. */
  optional?: boolean;
}

/** Table of the surface's measures: counts, topology, area, volume and validity. */
export class MeasurePanel {
  readonly element: HTMLElement;
  readonly #cells = new Map<Name, HTMLElement>();
  #unit: Unit = 'mm';
  #values: Partial<MeasureValues> = {};
  /** Measures of an edited surface, shown in place of the others. */
  #edited: Partial<MeasureValues> | undefined;
  readonly #extra: { measure: ExtraMeasure; cell: HTMLElement }[];
  #extraValues: Record<string, unknown> = {};

  /** `extra` is listed after the measures that every surface has. */
  constructor(extra: ExtraMeasure[] = []) {
    this.element = h('dl', { class: 'measures', 'data-measures': '{}' });
    for (const row of ROWS) this.#cells.set(row.name, this.#addRow(row));
    this.#extra = extra.map((measure) => ({ measure, cell: this.#addRow(measure) }));
  }

  #addRow({ name, label, help }: { name: string; label: string; help: string }): HTMLElement {
    const cell = h('dd', { 'data-measure': name }, '–');
    this.element.append(h('div', { title: help }, h('dt', {}, label), cell));
    return cell;
  }

  /** Shows the lab's own measures; values without a row appear only in `data-measures`. */
  showExtra(values: Record<string, unknown>): void {
    this.#extraValues = values;
    for (const { measure, cell } of this.#extra) {
      const value = values[measure.name];
      cell.textContent = typeof value === 'number' ? measure.text(value) : '–';
      if (measure.optional && cell.parentElement) cell.parentElement.hidden = typeof value !== 'number';
    }
    this.#publish();
  }

  /** Resets all measures to unknown, shown as dashes. */
  clear(): void {
    this.#show({});
    this.showExtra({});
  }

  #publish(): void {
    this.element.dataset.measures = JSON.stringify({ ...(this.#edited ?? this.#values), ...this.#extraValues });
  }

  /** Unit of length, by which volume and area are formatted. */
  set unit(unit: Unit) {
    this.#unit = unit;
    this.#show(this.#values);
  }

  /**
   * Shows the values that every step reports; area and volume stay as last measured. Results of mesh checks are reset,
   * because they do not hold once the surface has moved.
   */
  showReport({ vertices, triangles, components, euler }: StepReport): void {
    const { volume, area } = this.#values;
    const known: Partial<MeasureValues> = {
      vertices,
      triangles,
      components,
      chi: euler,
      genus: components - euler / 2,
    };
    if (volume !== undefined) known.volume = volume;
    if (area !== undefined) known.area = area;
    this.#show(known);
  }

  showMeasures(measures: Measures): void {
    this.#show(valuesOf(measures));
  }

  /** Shows the measures of an edited surface in place of the others; undefined shows these again. */
  showEdited(measures: Measures | undefined): void {
    this.#edited = measures && valuesOf(measures);
    this.#show(this.#values);
  }

  #show(values: Partial<MeasureValues>): void {
    this.#values = values;
    this.#publish();
    const shown = this.#edited ?? values;
    for (const [name, cell] of this.#cells) {
      const value = shown[name];
      const text = value === undefined ? '–' : textOf(name, value, this.#unit);
      if (cell.textContent !== text) cell.textContent = text;
      cell.classList.toggle('bad', value === false || (name === 'crossings' && Number(value) > 0));
    }
  }
}

function valuesOf({ info, report }: Measures): Partial<MeasureValues> {
  const { vertices, triangles, components, genus, volume, area } = info;
  const known: Partial<MeasureValues> = { vertices, triangles, components, chi: info.euler, genus, volume, area };
  if (!report) return known;
  return { ...known, closed: report.closed, oriented: report.oriented, crossings: report.selfIntersections };
}

function textOf(name: Name, value: number | boolean, unit: Unit): string {
  if (typeof value === 'boolean') return value ? text('controls.yes') : text('controls.no');
  if (name === 'volume') return sized(value, 3, unit);
  if (name === 'area') return sized(value, 2, unit);
  return count(value);
}

/**
 * Formats an area (power 2) or volume (power 3) with its unit; from 10 cm² or 10 cm³ on, values in millimetres are
 * converted to centimetres, and small ones as by {@link lengths}.
 */
export function sized(value: number, power: 2 | 3, unit: Unit): string {
  const raised = power === 2 ? '²' : '³';
  const inCentimetres = value / 10 ** power;
  if (unit === 'mm' && inCentimetres >= 10) return `${figure(inCentimetres)} cm${raised}`;
  return lengths([value], unit, power);
}
