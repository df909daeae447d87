/** Formats of other programs: which volume of several is opened, what is asked, and what becomes of names of patients. */
import { readFile } from 'node:fs/promises';
import { strFromU8, unzipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { AXIAL, type Elements } from '../js/dicom-files';
import { deflatedStack } from '../js/made-tiff';
import { type App, measures, openApp, reach } from './browser';
import { dicomSeries, type Given, type SeriesName, type Volume } from './pictures';

const SIDE = 20;
const RADIUS = 7;
const VOLUME = (4 / 3) * Math.PI * RADIUS ** 3;

/** A ball of intensity 1000, with 500 at its surface. */
const BALL: Volume = {
  data: Uint16Array.from({ length: SIDE ** 3 }, (_, i) => {
    const [x, y, z] = [i % SIDE, Math.floor(i / SIDE) % SIDE, Math.floor(i / SIDE ** 2)];
    const away = Math.hypot(x - 9.5, y - 9.5, z - 9.5);
    return 1000 + Math.round(1000 * Math.min(Math.max(0.5 + (RADIUS - away) / 2, 0), 1));
  }),
  dims: [SIDE, SIDE, SIDE],
  spacing: [1, 1, 1],
  origin: [0, 0, 0],
  along: AXIAL,
};

const BODY: SeriesName = { number: 2, description: 'Body' };
const CHEST: SeriesName = { number: 7, description: 'Chest' };
const PATIENT: Elements = { '00100010': ['PN', 'Doe^Jane'], '00100020': ['LO', 'ID-4711'] };

let app: App;

beforeAll(async () => {
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

const give = (files: Given[]) => app.page.setInputFiles('input[type=file]', files);
/** The dialog once it asks something: while files are read, it shows their progress. */
const dialog = () => app.page.locator('dialog.volume-choice[open]:has(form)');
const facts = () => app.page.textContent('.facts');
const warnings = () => app.page.textContent('[data-warning-list]');

async function opened(name: string): Promise<void> {
  await app.page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), name);
  await reach(app.page, 'done');
}

async function isBall(): Promise<void> {
  const { volume, components, closed } = await measures(app.page);
  expect({ components, closed }).toEqual({ components: 1, closed: true });
  expect(Number(volume) / VOLUME).toBeCloseTo(1, 1);
}

describe('DICOM', () => {
  test('of two series, the user chooses; names of patients are shown there, and nowhere else', async () => {
    const head: SeriesName = { number: 3, description: 'Head' };
    const other = dicomSeries({ ...BALL, dims: [SIDE, SIDE, 5] }, head, () => PATIENT);
    const files = [
      ...other.map((file) => ({ ...file, name: `H${file.name}` })),
      ...dicomSeries(BALL, BODY, () => PATIENT),
    ];
    await give([...files, { name: 'readme.txt', mimeType: 'text/plain', buffer: Buffer.from('nothing'.repeat(40)) }]);
    await dialog().waitFor();
    const text = (await dialog().textContent()) ?? '';
    for (const part of ['Body', 'Head', 'Doe Jane', 'CT', '20 × 20 × 5 voxels', '1 × 1 × 1 mm', 'Files left out: 1'])
      expect(text).toContain(part);
    await dialog().getByText('Head').click();
    await dialog().getByRole('button', { name: 'Open' }).click();
    await opened('Head');
    expect(await facts()).toContain('20 × 20 × 5');
    expect(await app.page.content()).not.toMatch(/Doe|Jane|4711/);

    await app.page.check('[data-session=included]');
    const click = app.page.click('[data-action=session]');
    const [download] = await Promise.all([app.page.waitForEvent('download'), click]);
    const parts = unzipSync(new Uint8Array(await readFile(await download.path())));
    for (const part of Object.values(parts)) expect(strFromU8(part, true)).not.toMatch(/Doe|Jane|4711/);
    expect(app.page.url()).not.toMatch(/Doe|Jane|4711/);
  });

  test('what is open stays if the user cancels the choice', async () => {
    const before = await facts();
    const other = dicomSeries({ ...BALL, dims: [SIDE, SIDE, 5] }, { number: 3, description: 'Head' });
    await give([...other.map((file) => ({ ...file, name: `H${file.name}` })), ...dicomSeries(BALL, BODY)]);
    await dialog().waitFor();
    await app.page.keyboard.press('Escape');
    await expect.poll(() => dialog().count()).toBe(0);
    expect(await facts()).toBe(before);
  });

  test('missing slices are said, and resampled only if the user says so', async () => {
    await give(dicomSeries(BALL, BODY).filter((_, k) => ![3, 6].includes(k)));
    await dialog().waitFor();
    expect(await dialog().textContent()).toContain('2 of 20 slices are missing: between 1 and 4');
    const open = dialog().getByRole('button', { name: 'Open' });
    expect(await open.isDisabled()).toBe(true);
    await dialog().getByRole('checkbox').check();
    await open.click();
    await opened('Body');
    expect(await warnings()).toContain('2 of 20 slices are missing');
    await isBall();
  });

  test('a localiser in the series is left out; another slice that does not fit is said', async () => {
    const [first] = dicomSeries(BALL, CHEST, () => ({
      '00080018': ['UI', '1.2.9'],
      '00200037': ['DS', '0\\1\\0\\0\\0\\-1'],
    })) as [Given];
    await give([{ ...first, name: 'scout' }, ...dicomSeries(BALL, CHEST)]);
    await opened('Chest');
    await isBall();
    expect(await facts()).toContain('One image of the series is not part of the volume');
    expect(await warnings()).toContain('0 warnings');
  });

  test('slopes of slices apply to each, a tilted gantry shears', async () => {
    const angle = Math.PI / 9;
    const files = dicomSeries(
      { ...BALL, data: BALL.data.map((value) => value - 1000) },
      { number: 4, description: 'Tilted' },
      (z) => {
        const slope = 0.5 + 0.1 * z;
        const voxels = BALL.data
          .slice(z * SIDE ** 2, (z + 1) * SIDE ** 2)
          .map((value) => Math.round((value - 1000) / slope));
        return {
          '00200037': ['DS', `1\\0\\0\\0\\${Math.cos(angle)}\\${-Math.sin(angle)}`],
          '00281052': ['DS', '0'],
          '00281053': ['DS', String(slope)],
          '7fe00010': ['OW', Buffer.from(voxels.buffer)],
        };
      },
    );
    await give(files);
    await opened('Tilted');
    const { volume } = await measures(app.page);
    expect(Number(volume) / (VOLUME * Math.cos(angle))).toBeCloseTo(1, 1);
    expect(await facts()).toMatch(/Intensities0 to 1,00\d/);
  });

  test('with time opens in Track', async () => {
    await app.page.goto(`${app.page.url().split('#')[0]}#track`);
    await app.page.waitForSelector('.lab.track .facts');
    const frame = (time: number) =>
      dicomSeries(BALL, { number: 5, description: 'Cine' }, (z) => ({
        '00080018': ['UI', `1.2.3.${time}.${z}`],
        '00181060': ['DS', String(40 * time)],
      })).map((file) => ({ ...file, name: `${time}-${file.name}` }));
    await give([...frame(0), ...frame(1), ...frame(2)]);
    await app.page.waitForFunction(() => /Frames3/.test(document.querySelector('.facts')?.textContent ?? ''));
    expect(await facts()).toContain('20 × 20 × 20');
  });
});

describe('other files', () => {
  test('two volumes at once: asked which', async () => {
    await app.page.goto(`${app.page.url().split('#')[0]}#extract`);
    await app.page.waitForSelector('.lab.extract .facts');
    const head = ['NRRD0004', 'type: uint8', 'dimension: 3', 'sizes: 4 4 4', 'encoding: raw', '', ''].join('\n');
    const buffer = Buffer.from(head + '\0'.repeat(64), 'latin1');
    await give(['one.nrrd', 'two.nrrd'].map((name) => ({ name, mimeType: '', buffer })));
    await dialog().waitFor();
    expect(await dialog().textContent()).toMatch(/Which volume\?.*one.nrrd.*two.nrrd/s);
    await dialog().getByText('two.nrrd').click();
    await dialog().getByRole('button', { name: 'Open' }).click();
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('two.nrrd'));
  });
});

test('what is decoded from a small file has the bounds of small files', async () => {
  const side = 120;
  // Rods of one voxel, whose contour has two triangles for each voxel.
  const rods = Uint8Array.from({ length: side ** 2 }, (_, i) =>
    i % 2 === 0 && Math.floor(i / side) % 2 === 0 ? 200 : 0,
  );
  const buffer = Buffer.from(
    deflatedStack(
      Array.from({ length: side }, () => rods),
      side,
    ),
  );
  expect(buffer.length).toBeLessThan(1e5);
  await give([{ name: 'rods.tif', mimeType: 'image/tiff', buffer }]);
  await expect.poll(() => app.page.textContent('.banner')).toContain('more than 2400000 triangles');
  await app.page.click('.banner button');
});
