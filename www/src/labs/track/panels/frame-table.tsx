import type { ReadonlySignal } from '@preact/signals';
import { count, figure } from '../../../kit/format';
import { kept } from '../../../kit/ui/mount';
import { Help, Scrolling } from '../../../kit/ui/parts';
import { plural, text } from '../../../texts';
import { warningsOf } from '../curve';
import type { FrameStatistics, SurfaceError } from '../protocol';

interface Column {
  head: string;
  help: string;
  text: (facts: FrameStatistics) => string;
}

const COLUMNS: Column[] = [
  {
    head: text('trackPanels.columnVolume'),
    help: text('trackPanels.columnVolumeHelp'),
    text: ({ volume }) => figure(volume),
  },
  { head: text('trackPanels.columnArea'), help: text('trackPanels.columnAreaHelp'), text: ({ area }) => figure(area) },
  {
    head: text('trackPanels.columnFolded'),
    help: text('trackPanels.columnFoldedHelp'),
    text: ({ folded }) => count(folded),
  },
  {
    head: text('trackPanels.columnCorrection'),
    help: text('trackPanels.columnCorrectionHelp'),
    text: ({ meanFinalCorrection }) => figure(round(meanFinalCorrection)),
  },
  {
    head: text('trackPanels.columnSteps'),
    help: text('trackPanels.columnStepsHelp'),
    text: ({ steps }) => figure(round(steps)),
  },
  {
    head: text('trackPanels.columnHeld'),
    help: text('trackPanels.columnHeldHelp'),
    text: ({ heldMoves }) => count(heldMoves),
  },
  {
    head: text('trackPanels.columnRejected'),
    help: text('trackPanels.columnRejectedHelp'),
    text: ({ rejected }) => count(rejected),
  },
  {
    head: text('trackPanels.columnRetracted'),
    help: text('trackPanels.columnRetractedHelp'),
    text: ({ withoutBoundary }) => count(withoutBoundary),
  },
];

const round = (value: number) => Number(value.toPrecision(3));

/** What the table shows of the frames: their statistics and errors, and which of them is the current one. */
export interface ShownFrames {
  facts: readonly FrameStatistics[];
  /** Distances to the true surface, where that is known. */
  errors: readonly (SurfaceError | undefined)[];
  frame: number;
}

export const NO_FRAMES: ShownFrames = { facts: [], errors: [], frame: 0 };

interface FramesProps {
  shown: ReadonlySignal<ShownFrames>;
}

/** Table of the Track lab with the statistics of each frame. */
export function FrameTable({ shown }: FramesProps) {
  const { facts, errors, frame } = shown.value;
  const hasErrors = errors.some((error) => error);
  const heads = [
    text('trackPanels.columnFrame'),
    ...COLUMNS.map(({ head }) => head),
    ...(hasErrors ? [text('trackPanels.columnError')] : []),
  ];
  return (
    <div>
      <Scrolling label={text('trackPanels.framesTable')} isTall>
        <table class="times">
          <thead>
            <tr>
              {heads.map((head, i) => (
                <th key={head} scope="col" title={COLUMNS[i - 1]?.help}>
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {facts.map((one, i) => (
              <FrameRow
                key={i}
                {...{ number: i + 1, facts: one, hasErrors, error: errors[i], isCurrent: i === frame }}
              />
            ))}
          </tbody>
        </table>
      </Scrolling>
      <Help>{text('trackPanels.framesTableHelp')}</Help>
    </div>
  );
}

interface RowProps {
  number: number;
  facts: FrameStatistics;
  hasErrors: boolean;
  error: SurfaceError | undefined;
  isCurrent: boolean;
}

const FrameRow = kept(({ number, facts, hasErrors, error, isCurrent }: RowProps) => (
  <tr aria-current={isCurrent ? 'true' : undefined}>
    <th scope="row">{number}</th>
    {COLUMNS.map(({ head, text }) => (
      <td key={head}>{text(facts)}</td>
    ))}
    {hasErrors && <td>{error && figure(round(error.mean))}</td>}
  </tr>
));

/** Warnings about folded triangles and jumps of the area. */
export function FrameWarnings({ shown }: FramesProps) {
  const found = warningsOf(shown.value.facts);
  const warning = (kind: 'folded' | 'area', key: 'trackPanels.foldedWarning' | 'trackPanels.areaWarning') => {
    const those = found.filter((one) => one.kind === kind);
    if (those.length === 0) return [];
    const most = Math.max(...those.map(({ share }) => Math.abs(share)));
    return [plural(key, those.length, { most: text('controls.percent', { value: (100 * most).toFixed(1) }) })];
  };
  return (
    <p class="warning" role="status" data-warnings={found.length}>
      {[...warning('folded', 'trackPanels.foldedWarning'), ...warning('area', 'trackPanels.areaWarning')].join(' ')}
    </p>
  );
}
