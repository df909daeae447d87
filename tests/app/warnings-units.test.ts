/** Warnings in what the labs save, and which of them concern what. */
import init, { Volume } from 'vesicle';
import { beforeAll, describe, expect, test } from 'vitest';
import { viewOf } from '../../www/src/engine/volumes';
import { cellOf, concerning, merged, placeText, type Warning } from '../../www/src/engine/warnings';
import { History } from '../../www/src/kit/history';
import { toCsv } from '../../www/src/lab/run-table';
import { framesCsv } from '../../www/src/labs/track/measures';

const LONG_VOXELS: Warning = { code: 'anisotropic', text: 'Voxels are long, very long.' };
const ENDS: Warning = { code: 'ends-in-frame', text: 'It ends.', where: { frame: 2 } };
const THIN: Warning = { code: 'thin-label', text: 'It is thin.', where: { label: 5 } };
const LEFT_OUT: Warning = { code: 'reader', text: 'A slice is missing.', where: { point: [1, 2.5, -3] } };
const ALL = [LONG_VOXELS, ENDS, THIN, LEFT_OUT];

beforeAll(() => init());

test('warnings with the same kind and place are one, but for those of readers', () => {
  const again = { ...ENDS, text: 'It ends here.' };
  const other: Warning = { code: 'reader', text: 'The unit is not known.' };
  expect(merged([LONG_VOXELS, ENDS], [again, { ...ENDS, where: { frame: 3 } }])).toEqual([
    ...[LONG_VOXELS, ENDS],
    { ...ENDS, where: { frame: 3 } },
  ]);
  expect(merged([other], [{ ...other, text: 'The space is not known.' }, other])).toHaveLength(2);
});

test('warnings about other frames or labels do not concern one', () => {
  expect(concerning(ALL, { frame: 2 })).toEqual(ALL);
  expect(concerning(ALL, { frame: 0 })).toEqual([LONG_VOXELS, THIN, LEFT_OUT]);
  expect(concerning(ALL, { label: 1 })).toEqual([LONG_VOXELS, ENDS, LEFT_OUT]);
});

test('frames are counted from 1 where people read them', () => {
  expect(ALL.flatMap(({ where }) => (where ? [placeText(where)] : []))).toEqual([
    'Frame 3',
    'Label 5',
    'At 1, 2.5, -3',
  ]);
});

test('the view of a volume has its warnings', () => {
  const volume = new Volume({ data: new Uint8Array([0, 1]), dims: [2, 1, 1], warnings: [LONG_VOXELS, LEFT_OUT] });
  expect(viewOf(volume, 'a').warnings).toEqual([LONG_VOXELS, LEFT_OUT]);
});

describe('CSV', () => {
  const report = (iteration: number, warnings: Warning[]) => ({
    ...{ iteration, done: false, phase: 'solve', progress: 0, residual: 1, tolerance: 0.5 },
    ...{ vertices: 4, triangles: 4, components: 1, euler: 2, times: {}, warnings },
    events: { creations: 0, deletions: 0, inversions: 0, axial: 0, annular: 0, vanished: 0, seeds: 0 },
  });
  const cells = (csv: string) => csv.split('\n').map((line) => line.split(','));

  test('has a last column of codes if there are warnings, and the same number of cells in each line', () => {
    const history = new History();
    history.add([report(1, []), report(2, [ENDS])]);
    const [head = [], first = [], second = []] = cells(toCsv(history, [LONG_VOXELS, ENDS]));
    expect([head.at(-1), first.at(-1), second.at(-1)]).toEqual([
      ...['warnings', 'anisotropic', 'anisotropic; ends-in-frame (frame 3)'],
    ]);
    expect([first.length, second.length]).toEqual([head.length, head.length]);
  });

  test('is as ever without warnings', () => {
    const history = new History();
    history.add([report(1, [])]);
    expect(toCsv(history, [])).not.toContain('warnings');
    expect(framesCsv([], undefined, [])).not.toContain('warnings');
  });

  test('of frames has the warnings that concern each', () => {
    const frame = { facts: {}, measures: {} } as Parameters<typeof framesCsv>[0][number];
    const lines = cells(framesCsv([frame, frame, frame], undefined, [[], [], [ENDS]]));
    expect(lines.map((line) => line.at(-1))).toEqual(['warnings', '', '', 'ends-in-frame (frame 3)', '']);
  });

  test('cells have no commas', () => {
    expect(cellOf(ALL)).not.toContain(',');
  });
});
