/** Opening files of scanners and microscopes in the app. */
import { readFile } from 'node:fs/promises';
import init, { Mesh } from 'vesicle';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import { type App, measures, openApp, reach } from './browser';
import { LONG } from './long';
import { dicomSeries, type Given, tiffStack } from './pictures';

const [WIDE, HIGH, DEEP] = [24, 20, 16];
/** Semi-axes of an ellipsoid in voxels. */
const AXES = [9, 7, 5];

/** Returns voxels that are bright inside the ellipsoid in the middle, and 128 at its surface. */
function ellipsoid(): number[] {
  return Array.from({ length: WIDE * HIGH * DEEP }, (_, i) => {
    const place = [i % WIDE, Math.floor(i / WIDE) % HIGH, Math.floor(i / (WIDE * HIGH))];
    const middle = [WIDE, HIGH, DEEP].map((n) => (n - 1) / 2);
    const level = Math.hypot(...place.map((n, k) => (n - (middle[k] ?? 0)) / (AXES[k] ?? 1)));
    return Math.round(Math.min(Math.max(128 + 1500 * (1 - level), 0), 255));
  });
}

/** Volume of the ellipsoid in voxels. */
const VOLUME = (4 / 3) * Math.PI * AXES.reduce((product, axis) => product * axis, 1);

const pages = () => {
  const values = Uint8Array.from(ellipsoid());
  return Array.from({ length: DEEP }, (_, z) => values.slice(z * WIDE * HIGH, (z + 1) * WIDE * HIGH));
};

const OME =
  '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0"><Pixels ID="Pixels:0" ' +
  `DimensionOrder="XYCZT" Type="uint8" SizeX="${WIDE}" SizeY="${HIGH}" SizeZ="${DEEP}" SizeC="2" SizeT="1" ` +
  'PhysicalSizeX="0.5" PhysicalSizeY="0.5" PhysicalSizeZ="1.25"/></Image></OME>';

let app: App;

beforeAll(async () => {
  app = await openApp();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

async function open(files: Given[], name: string): Promise<void> {
  await app.page.setInputFiles('input[type=file]', files);
  await app.page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), name);
  await reach(app.page, 'done');
}

const named = (name: string) =>
  app.page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), name);

const fact = (name: string) =>
  app.page
    .locator('.facts dt', { hasText: new RegExp(`^${name}$`) })
    .locator('+ dd')
    .textContent();

async function hasVolume(voxel: number): Promise<void> {
  const { volume, components, closed } = await measures(app.page);
  expect({ components, closed }).toEqual({ components: 1, closed: true });
  expect(Number(volume) / (voxel * VOLUME)).toBeCloseTo(1, 1);
}

describe('DICOM', () => {
  test('a series in any order, oblique, with rescaled intensities', async () => {
    const data = Uint16Array.from(ellipsoid(), (value) => value + 1000);
    const along: [number, number, number, number, number, number] = [0.8, 0.6, 0, -0.6, 0.8, 0];
    const grid = { data, dims: [WIDE, HIGH, DEEP] as [number, number, number], along };
    await open(dicomSeries({ ...grid, spacing: [0.5, 0.75, 2], origin: [10, -20, 30] }), 'CT');
    expect(await fact('Voxels')).toBe('24 × 20 × 16');
    expect(await fact('Voxel size')).toBe('0.5 × 0.75 × 2 mm');
    expect(await fact('Intensities')).toBe('0 to 255');
    await hasVolume(0.5 * 0.75 * 2);
    const click = app.page.click('[data-export=ply]');
    const [download] = await Promise.all([app.page.waitForEvent('download'), click]);
    await init();
    const { centroid } = Mesh.parse(await readFile(await download.path())).info();
    // Centre of the voxel grid, from its directions, spacing and origin.
    for (const [axis, expected] of [10.325, -10.85, 45].entries()) expect(centroid[axis]).toBeCloseTo(expected, 1);
  });

  test('a segmentation alone opens as a volume of its labels', LONG, async () => {
    const buffer = await readFile('tests/data/volumes/segmentation/binary.dcm');
    await open([{ name: 'binary.dcm', mimeType: 'application/dicom', buffer }], 'SEG');
    expect(await fact('Voxels')).toBe('20 × 16 × 9');
    expect(await fact('Intensities')).toBe('0 to 3');
  });

  test('invalid DICOM files are refused with a reason', async () => {
    const broken = Buffer.concat([Buffer.alloc(128), Buffer.from('DICM'), Buffer.from('nothing of that kind')]);
    await app.page.setInputFiles('input[type=file]', [
      { name: 'x.dcm', mimeType: 'application/dicom', buffer: broken },
    ]);
    await expect.poll(() => app.page.textContent('.banner')).toMatch(/the files hold no volume: .*could not be read/);
  });
});

describe('a dropped folder', () => {
  /** Drops a folder with folders in it, as from the desktop; `tree` has files by their paths. */
  function dropFolder(name: string, tree: Record<string, Buffer>): Promise<void> {
    const files = Object.entries(tree).map(([path, bytes]) => ({ path, base64: bytes.toString('base64') }));
    return app.page.evaluate(
      ({ name, files }) => {
        const fileEntry = (path: string, base64: string) => {
          const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
          const file = new File([bytes], path.split('/').at(-1) ?? '');
          return { isFile: true, name: file.name, file: (take: (file: File) => void) => take(file) };
        };
        const folderEntry = (name: string, inside: typeof files): object => {
          const folders = new Set(inside.flatMap(({ path }) => (path.includes('/') ? [path.split('/')[0] ?? ''] : [])));
          const under = (folder: string) =>
            inside.flatMap(({ path, base64 }) =>
              path.startsWith(`${folder}/`) ? [{ path: path.slice(folder.length + 1), base64 }] : [],
            );
          const entries = [
            ...inside.flatMap(({ path, base64 }) => (path.includes('/') ? [] : [fileEntry(path, base64)])),
            ...Array.from(folders, (folder) => folderEntry(folder, under(folder))),
          ];
          // Like browsers, which return some entries at a time.
          const createReader = () => {
            const rest = [...entries];
            return { readEntries: (take: (some: object[]) => void) => take(rest.splice(0, 5)) };
          };
          return { isDirectory: true, name, createReader };
        };
        const item = { kind: 'file', webkitGetAsEntry: () => folderEntry(name, files) };
        const dataTransfer = { types: ['Files'], files: [], items: [item] };
        const event = new DragEvent('drop', { bubbles: true, cancelable: true });
        Object.defineProperty(event, 'dataTransfer', { value: dataTransfer });
        window.dispatchEvent(event);
      },
      { name, files },
    );
  }

  test('with DICOM files is read with its folders; other files are left out', async () => {
    const data = Uint16Array.from(ellipsoid(), (value) => value + 1000);
    const grid = { data, along: [1, 0, 0, 0, 1, 0] as [number, number, number, number, number, number] };
    const place = { spacing: [1, 1, 1], origin: [0, 0, 0] } as const;
    const body = { ...grid, dims: [WIDE, HIGH, DEEP], ...place } as Parameters<typeof dicomSeries>[0];
    const scout = { ...body, dims: [WIDE, HIGH, 2] } as typeof body;
    const tree = { 'readme.txt': Buffer.from('no image'), 'study/DICOMDIR': Buffer.from('neither') };
    const put = (folder: string, files: Given[]) =>
      Object.fromEntries(files.map(({ name, buffer }) => [`${folder}/${name}`, buffer]));
    await dropFolder('patient', {
      ...tree,
      ...put('study/1', dicomSeries(scout, { number: 1, description: 'Scout' })),
      ...put('study/2', dicomSeries(body, { number: 2, description: 'Body' })),
    });
    await app.page.getByRole('dialog').getByText('Body').click();
    await app.page.getByRole('button', { name: 'Open', exact: true }).click();
    await named('Body');
    await reach(app.page, 'done');
    expect(await fact('Voxels')).toBe('24 × 20 × 16');
    await hasVolume(1);
  });

  test('without a volume is refused with a reason, and what was open stays', async () => {
    const before = await measures(app.page);
    await dropFolder('letters', { 'a.txt': Buffer.from('a'), 'b.txt': Buffer.from('b'), 'c.txt': Buffer.from('c') });
    await expect.poll(() => app.page.textContent('.banner')).toMatch(/letters could not be opened/);
    expect(await app.page.textContent('.banner')).toContain('3 files');
    expect(await measures(app.page)).toEqual(before);
  });
});

describe('TIFF', () => {
  test('OME: of two channels one is chosen', async () => {
    const second = new Uint8Array(WIDE * HIGH).fill(255);
    const file = tiffStack(
      pages().flatMap((page) => [page, second]),
      [WIDE, HIGH],
      OME,
    );
    await app.page.setInputFiles('input[type=file]', [{ name: 'cell.ome.tif', mimeType: 'image/tiff', buffer: file }]);
    const dialog = app.page.locator('dialog[open]:has(form.choice-form)');
    await dialog.waitFor();
    expect(await dialog.textContent()).toMatch(/cell, channel .*cell, channel /);
    await dialog.getByRole('button', { name: 'Open' }).click();
    await named('cell.ome.tif');
    await reach(app.page, 'done');
    expect(await fact('Voxels')).toBe('24 × 20 × 16');
    expect(await fact('Voxel size')).toBe('0.5 × 0.5 × 1.25 µm');
    await hasVolume(0.5 * 0.5 * 1.25);
  });

  test('one file per slice, in the order of the numbers in their names', LONG, async () => {
    const files = pages().map((page, z) => ({
      ...{ name: `slice${z}.tif`, mimeType: 'image/tiff' },
      buffer: tiffStack([page], [WIDE, HIGH], ''),
    }));
    await open(files.reverse(), 'slice');
    expect(await fact('Voxels')).toBe('24 × 20 × 16');
    await hasVolume(1);
  });

  test('pages of different sizes are refused', async () => {
    const files = [WIDE, WIDE - 1].map((wide, z) => ({
      ...{ name: `slice${z}.tif`, mimeType: 'image/tiff' },
      buffer: tiffStack([new Uint8Array(wide * HIGH)], [wide, HIGH], ''),
    }));
    await app.page.setInputFiles('input[type=file]', files);
    await expect
      .poll(() => app.page.textContent('.banner'))
      .toMatch(/TIFF: slice1.tif: page 1: the image has 23 × 20 pixels, .* but the first one 24 × 20 pixels/);
  });

  test('a single slice is refused', async () => {
    const file = { name: 'slice.tif', mimeType: 'image/tiff', buffer: tiffStack([new Uint8Array(4)], [2, 2], '') };
    await app.page.setInputFiles('input[type=file]', [file]);
    await expect.poll(() => app.page.textContent('.banner')).toMatch(/TIFF: this is a single slice; open all files/);
  });

  test('more files than a header and its data are refused', async () => {
    const files = ['a', 'b', 'c'].map((name) => ({ name, mimeType: '', buffer: Buffer.from(name) }));
    await app.page.setInputFiles('input[type=file]', files);
    await expect.poll(() => app.page.textContent('.banner')).toMatch(/3 files are neither a series/);
  });
});
