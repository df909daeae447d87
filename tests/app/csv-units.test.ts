/** Tables as spreadsheets open them. */
import { expect, test } from 'vitest';
import type { StepReport } from '../../www/src/engine/protocol';
import { csvOf } from '../../www/src/kit/csv';
import { toCsv } from '../../www/src/lab/run-table';

test('numbers stay numbers, texts are quoted, and none is a formula', () => {
  const texts = [
    '=HYPERLINK("http://a.b")',
    '+1',
    '-2',
    '−3',
    '@SUM(A1)',
    '\tx',
    '\rx',
    'a,b',
    'say "so"',
    'two\nlines',
    'a;=b',
  ];
  expect(csvOf([[-1.5, undefined, true, 'plain'], texts])).toBe(
    `-1.5,,true,plain
"'=HYPERLINK(""http://a.b"")",'+1,'-2,'−3,'@SUM(A1),"'\tx","'\rx","a,b","say ""so""","two\nlines",a;'=b
`,
  );
});

test('a session cannot bring a formula into the data of the plots', () => {
  const report = { iteration: 1, events: {}, times: { '=HYPERLINK("http://a.b","c")': 1 } } as unknown as StepReport;
  const [head = ''] = toCsv({ reports: [report] } as never).split('\n');
  expect(head).toContain(`"'=HYPERLINK(""http://a.b"",""c"") (ms)"`);
  expect(head).not.toMatch(/(^|,)"?=/);
});
