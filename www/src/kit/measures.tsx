import { signal } from '@preact/signals';
import type { Measures, StepReport, Unit } from '../engine/protocol';
import { text } from '../texts';
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

/** The measures of a surface, as their table shows them. */
export class SurfaceMeasures {
  readonly unit = signal<Unit>('mm');
  readonly values = signal<Partial<MeasureValues>>({});
  /** Measures of an edited surface, shown in place of the others. */
  readonly edited = signal<Partial<MeasureValues> | undefined>(undefined);
  /** Measures that only this lab has; those without a row appear only in `data-measures`. */
  readonly extra = signal<Record<string, unknown>>({});

  /** Resets all measures to unknown, shown as dashes. */
  clear(): void {
    this.values.value = {};
    this.extra.value = {};
  }

  /**
   * Shows the values that every step reports; area and volume stay as last measured. Results of mesh checks are reset,
   * because they do not hold once the surface has moved.
   */
  showReport({ vertices, triangles, components, euler }: StepReport): void {
    const { volume, area } = this.values.peek();
    const genus = components - euler / 2;
    const measured = { ...(volume !== undefined && { volume }), ...(area !== undefined && { area }) };
    this.values.value = { vertices, triangles, components, chi: euler, genus, ...measured };
  }

  showMeasures(measures: Measures): void {
    this.values.value = valuesOf(measures);
  }

  /** Shows the measures of an edited surface in place of the others; undefined shows these again. */
  showEdited(measures: Measures | undefined): void {
    this.edited.value = measures && valuesOf(measures);
  }
}

interface TableProps {
  measures: SurfaceMeasures;
  /** Measures that are listed after those that every surface has. */
  extra?: readonly ExtraMeasure[];
}

/** Table of the surface's measures: counts, topology, area, volume and validity. */
export function MeasureTable({ measures, extra = [] }: TableProps) {
  const shown = measures.edited.value ?? measures.values.value;
  const own = measures.extra.value;
  const unit = measures.unit.value;
  return (
    <dl class="measures" data-measures={JSON.stringify({ ...shown, ...own })}>
      {ROWS.map(({ name, label, help }) => {
        const value = shown[name];
        const isBad = value === false || (name === 'crossings' && Number(value) > 0);
        return (
          <div key={name} title={help}>
            <dt>{label}</dt>
            <dd data-measure={name} class={isBad ? 'bad' : undefined}>
              {value === undefined ? '–' : textOf(name, value, unit)}
            </dd>
          </div>
        );
      })}
      {extra.map(({ name, label, help, text: shownAs, optional }) => {
        const value = own[name];
        const isKnown = typeof value === 'number';
        return (
          <div key={name} title={help} hidden={optional === true && !isKnown}>
            <dt>{label}</dt>
            <dd data-measure={name}>{isKnown ? shownAs(value) : '–'}</dd>
          </div>
        );
      })}
    </dl>
  );
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
