import type { ReadonlySignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import type { History } from '../../../kit/history';
import { Help, Scrolling } from '../../../kit/ui/parts';
import { text } from '../../../texts';

/**
 * Rows of tables of times, as in tables 1 and 2 of Lachaud and Montanvert: their letter, the name on the page, and the
 * parts of a step that are summed.
 */
export const TIME_ROWS = [
  { letter: 'T', name: text('extractPanels.timeTopology'), parts: ['topology', 'embedding'] },
  { letter: 'N', name: text('extractPanels.timeNormals'), parts: ['normals'] },
  { letter: 'F', name: text('extractPanels.timeDynamics'), parts: ['forces', 'motion'] },
] as const;
const DETAILS = [
  { part: 'topology', name: text('extractPanels.timeTopology') },
  { part: 'embedding', name: text('extractPanels.timeEmbedding') },
  { part: 'forces', name: text('extractPanels.timeForces') },
  { part: 'motion', name: text('extractPanels.timeMotion') },
];
export const TIME_NOTE = text('extractPanels.timeNote');

/** Milliseconds by part of a step ('topology', 'forces' ...), the keys as in step reports. */
export type PartTimes = ReadonlyMap<string, number>;

/** Returns the sum of the times of some parts of a step, or of all, in milliseconds. */
export function timeOf(times: PartTimes, parts?: readonly string[]): number {
  return [...times].reduce((sum, [part, ms]) => sum + (!parts || parts.includes(part) ? ms : 0), 0);
}

export function addTimes(lists: PartTimes[]): PartTimes {
  const sum = new Map<string, number>();
  for (const list of lists) for (const [part, ms] of list) sum.set(part, (sum.get(part) ?? 0) + ms);
  return sum;
}

export function seconds(ms: number): string {
  return (ms / 1000).toFixed(ms < 9950 ? 2 : 1);
}

/**
 * Table of the time that an extraction spent by part of a step and level, in seconds, in the layout of tables 1 and 2
 * of Lachaud and Montanvert.
 */
export function TimeTable({ run }: { run: ReadonlySignal<Pick<History, 'times'>> }) {
  const { times } = run.value;
  const columns: Column[] = [...times, [text('extractPanels.timeTotal'), addTimes([...times.values()])]];
  return (
    <div>
      <Scrolling label={text('extractPanels.timeTable')}>
        <table class="times">
          <thead>
            <tr>
              {[text('extractPanels.timePart'), ...columns.map(([title]) => title)].map((title) => (
                <th key={title} scope="col">
                  {title}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {TIME_ROWS.map(({ letter, name, parts }) => (
              <TimeRow key={letter} {...{ columns, parts }}>
                <i>{letter}</i> {name}
              </TimeRow>
            ))}
            {DETAILS.map(({ part, name }) => (
              <TimeRow key={part} {...{ columns, parts: [part], class: 'detail' }}>
                {name}
              </TimeRow>
            ))}
          </tbody>
          <tfoot>
            <TimeRow columns={columns}>{text('extractPanels.timeTotal')}</TimeRow>
          </tfoot>
        </table>
      </Scrolling>
      <Help>{TIME_NOTE}</Help>
    </div>
  );
}

/** Heading of a column, and its times. */
type Column = readonly [string, PartTimes];

interface RowProps {
  columns: Column[];
  /** Parts of a step whose times are summed; all if undefined. */
  parts?: readonly string[];
  class?: string;
  children: ComponentChildren;
}

function TimeRow({ columns, parts, children, ...props }: RowProps) {
  return (
    <tr {...props}>
      <th scope="row">{children}</th>
      {columns.map(([title, times]) => (
        <td key={title}>{seconds(timeOf(times, parts))}</td>
      ))}
    </tr>
  );
}
