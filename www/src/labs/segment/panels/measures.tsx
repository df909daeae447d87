import type { ReadonlySignal } from '@preact/signals';
import type { Label } from '../../../engine/labels';
import type { Unit } from '../../../engine/protocol';
import { count, figure } from '../../../kit/format';
import { sized } from '../../../kit/measures';
import { kept } from '../../../kit/ui/mount';
import { Help } from '../../../kit/ui/parts';
import { text } from '../../../texts';

/** Measures of a label and its surface; lengths are in world units. */
export interface LabelMeasures {
  value: number;
  voxels: number;
  volume: number;
  area: number;
  vertices: number;
  triangles: number;
  /** Number of surfaces of this label that have been shown so far. */
  version: number;
}

export interface MeasuresShown {
  labels: readonly Label[];
  measures: ReadonlyMap<number, LabelMeasures>;
  unit: Unit;
  /**
   * Only for other programs: milliseconds from the end of the last stroke until its surfaces were drawn, and how often
   * surfaces were shown.
   */
  more: { latency: { first?: number; smooth?: number }; updates: number };
}

/** Table of the measures of all labels, also available to other programs as JSON in `data-measures`. */
export function LabelMeasureTable({ shown }: { shown: ReadonlySignal<MeasuresShown> }) {
  const { labels, measures, unit, more } = shown.value;
  const all = labels.map(({ value, name }) => ({ name, ...(measures.get(value) ?? { value, voxels: 0 }) }));
  const heads = [text('segment.labelHead'), text('segment.voxels'), text('measures.volume'), text('measures.area')];
  return (
    <div data-measures={JSON.stringify({ labels: all, ...more })}>
      <div class="scroll tall">
        <table class="times label-measures">
          <thead>
            <tr>
              {heads.map((name) => (
                <th key={name} scope="col">
                  {name}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {labels.map((label) => (
              <MeasureRow key={label.value} label={label} measures={measures.get(label.value)} unit={unit} />
            ))}
          </tbody>
        </table>
      </div>
      <Help>{text('segment.measuresHelp')}</Help>
    </div>
  );
}

interface RowProps {
  label: Label;
  measures: LabelMeasures | undefined;
  unit: Unit;
}

const MeasureRow = kept(({ label: { name, color }, measures, unit }: RowProps) => {
  const { voxels = 0, volume = 0, area = 0 } = measures ?? {};
  return (
    <tr>
      <th scope="row">
        <span class="dot" aria-hidden="true" style={{ background: color }} />
        {name}
      </th>
      <td>{count(voxels)}</td>
      <td>{volumeText(volume, unit)}</td>
      <td>{sized(area, 2, unit)}</td>
    </tr>
  );
});

/** Formats a volume; from 1 ml on, cubic millimetres are converted to millilitres. */
function volumeText(volume: number, unit: Unit): string {
  return unit === 'mm' && volume >= 1000
    ? text('segment.millilitres', { value: figure(volume / 1000) })
    : sized(volume, 3, unit);
}
