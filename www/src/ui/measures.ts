import type { Measures, StepReport } from '../protocol';
import { h } from './dom';
import { count, figure } from './format';

/** Every measure, as it can be read by other programs from the element's `data-measures`. */
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
  { name: 'vertices', label: 'Vertices', help: 'Points of the mesh' },
  { name: 'triangles', label: 'Triangles', help: 'Faces of the mesh' },
  { name: 'components', label: 'Components', help: 'Separate closed surfaces' },
  { name: 'genus', label: 'Genus', help: 'Handles, all components together' },
  { name: 'chi', label: 'Euler characteristic χ', help: 'Vertices − edges + triangles = 2 × components − 2 × genus' },
  { name: 'volume', label: 'Volume', help: 'Enclosed volume' },
  { name: 'area', label: 'Area', help: 'Area of the surface' },
  {
    name: 'closed',
    label: 'Closed',
    help: 'No edge without its second triangle; checked when the surface stands still',
  },
  {
    name: 'oriented',
    label: 'Oriented',
    help: 'All triangles face outwards alike; checked when the surface stands still',
  },
  {
    name: 'crossings',
    label: 'Crossings',
    help: 'Pairs of triangles that cross; counted when the surface stands still',
  },
];

/** The measures of the surface. Volume and area are in millimetres, as medical files mean them. */
export class MeasurePanel {
  readonly element: HTMLElement;
  readonly #cells = new Map<Name, HTMLElement>();
  #values: Partial<MeasureValues> = {};

  constructor() {
    this.element = h('dl', { class: 'measures', 'data-measures': '{}' });
    for (const { name, label, help } of ROWS) {
      const cell = h('dd', { 'data-measure': name }, '–');
      this.#cells.set(name, cell);
      this.element.append(h('div', { title: help }, h('dt', {}, label), cell));
    }
  }

  clear(): void {
    this.#show({});
  }

  /** What every step reports anyway. What was found by a check no longer holds once the surface moves on. */
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

  showMeasures({ info, report }: Measures): void {
    const { vertices, triangles, components, genus, volume, area } = info;
    const known: Partial<MeasureValues> = { vertices, triangles, components, chi: info.euler, genus, volume, area };
    if (report) {
      known.closed = report.closed;
      known.oriented = report.oriented;
      known.crossings = report.selfIntersections;
    }
    this.#show(known);
  }

  #show(values: Partial<MeasureValues>): void {
    this.#values = values;
    this.element.dataset.measures = JSON.stringify(values);
    for (const [name, cell] of this.#cells) {
      const value = values[name];
      const text = value === undefined ? '–' : textOf(name, value);
      if (cell.textContent !== text) cell.textContent = text;
      cell.classList.toggle('bad', value === false || (name === 'crossings' && Number(value) > 0));
    }
  }
}

function textOf(name: Name, value: number | boolean): string {
  if (typeof value === 'boolean') return value ? 'yes' : 'no';
  if (name === 'volume') return volumeText(value);
  if (name === 'area') return `${figure(value / 100)} cm²`;
  return count(value);
}

function volumeText(cubicMillimetres: number): string {
  return `${figure(cubicMillimetres / 1000)} cm³`;
}
