// The public API changes only together with its reports, so that whoever reads a change sees it.
import { mkdtemp, readdir, readFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { describe, expect, test } from 'vitest';
import { entries, REPORTS, report } from '../../scripts/api.mjs';

const folder = await mkdtemp(join(tmpdir(), 'api-'));

describe('reports of the public API, which `npm run api` writes', () => {
  test('there is one for each entry point', async () => {
    const reports = await readdir(REPORTS);
    expect(reports.sort()).toEqual(
      entries()
        .map(({ name }) => `${name}.api.md`)
        .sort(),
    );
  });

  test.each(entries())('$name is as reported', async (entry) => {
    report(entry, folder);
    const [now, recorded] = await Promise.all(
      [folder, REPORTS].map((place) => readFile(join(place, `${entry.name}.api.md`), 'utf8')),
    );
    expect(now).toBe(recorded);
  });
});
