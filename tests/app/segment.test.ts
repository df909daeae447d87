/** The Segment lab: labels are painted on slices, and their surfaces follow. */
import { readFile } from 'node:fs/promises';
import { strFromU8, unzipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { labelTooth } from '../../www/src/labs/segment/labelling';
import {
  type App,
  anotherPage,
  drop,
  openApp,
  overflow,
  reach,
  recordStates,
  unfold,
  unnamedControls,
} from './browser';
import { LONG } from './long';
import { dicomSeries } from './pictures';
import { changes } from './pixels';
import { ball } from './volumes';

/** The status when surfaces follow no further. */
const STOPPED = 'Cancelled: the surfaces remain unchanged until the next change.';

/** Size of the ball's volume. */
const SIZE = 32;

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp({ width: 1280, height: 800 }, 'bench.html', 1);
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

interface Measured {
  name: string;
  value: number;
  voxels: number;
  volume: number;
  area: number;
  vertices: number;
  triangles: number;
  version: number;
}

interface Report {
  labels: Measured[];
  latency: { first?: number; smooth?: number };
  /** Number of times that surfaces were shown. */
  updates: number;
}

async function measured(): Promise<Report> {
  return JSON.parse((await app.page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
}

/** Returns the measures of a label. */
async function of(value: number): Promise<Measured> {
  const found = (await measured()).labels.find((label) => label.value === value);
  return found ?? { name: '', value, voxels: 0, volume: 0, area: 0, vertices: 0, triangles: 0, version: 0 };
}

async function openAt(hash: string): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(app.address + hash);
  await reach(app.page, 'done');
}

const text = (selector: string) => app.page.locator(selector).first().textContent();

/** Returns the file of the ball of radius 10 voxels, with voxels of 1 × 1 × 2 mm, away from the origin. */
function ballFile(data: Uint8Array | Float32Array = ball(), spacing: [number, number, number] = [1, 1, 2]): Uint8Array {
  const volume = new Volume({ data, dims: [SIZE, SIZE, SIZE], spacing, origin: [5, -7, 11] });
  const file = volume.toBytes('nifti');
  volume.free();
  return file;
}

/** Makes a change that opens something, which may have the name of what was open before, and waits until it is open. */
async function opened(change: () => Promise<unknown>): Promise<void> {
  const states = await recordStates(app.page);
  await change();
  await expect.poll(async () => (await states()).join(' ')).toMatch(/^loading\b.* done$/);
}

/** Opens the ball with an empty label map. */
async function openBall(): Promise<void> {
  if (!app.page.url().includes('#segment')) await openAt('#segment?example=ovule');
  await opened(() => drop(app.page, [{ name: 'ball.nii', bytes: ballFile() }]));
  await expect.poll(async () => (await measured()).labels).toEqual([{ name: 'Label 1', value: 1, voxels: 0 }]);
  await reach(app.page, 'done');
}

/** Drags on a slice from one voxel of its picture to others, counted from the middle of the picture. */
async function drag(slice: string, ...places: [number, number][]): Promise<void> {
  const box = await app.page.locator(`.slice canvas[aria-label^="${slice}"]`).boundingBox();
  if (!box) throw new Error(`there is no ${slice} slice`);
  // Voxels of the axial slice are squares.
  const scale = Math.min(box.width, box.height) / SIZE;
  const at = ([x, y]: [number, number]) =>
    [box.x + box.width / 2 + x * scale, box.y + box.height / 2 + y * scale] as const;
  const [first, ...others] = places;
  await app.page.mouse.move(...at(first ?? [0, 0]));
  await app.page.mouse.down();
  for (const place of others) await app.page.mouse.move(...at(place), { steps: 4 });
  await app.page.mouse.up();
}

/** Makes a change of the voxels, and waits until the surfaces have followed. */
async function followed(change: () => Promise<unknown>): Promise<void> {
  const updates = async () => (await measured()).updates;
  const before = await updates();
  await change();
  await expect.poll(updates).toBeGreaterThan(before);
  await reach(app.page, 'done');
  // The last surfaces are smooth, and drawn.
  await expect.poll(async () => (await measured()).latency.smooth).toBeGreaterThan(0);
}

async function tool(name: string, radius?: number): Promise<void> {
  await app.page.check(`input[data-tool=${name}]`);
  if (radius !== undefined) await app.page.fill('[data-tool-setting=radius]', String(radius));
}

async function saved(selector: string): Promise<{ name: string; bytes: Uint8Array }> {
  const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click(selector)]);
  return { name: download.suggestedFilename(), bytes: new Uint8Array(await readFile(await download.path())) };
}

/** Returns the voxels of the label map, from its file. */
async function voxels(format = 'nrrd'): Promise<number[]> {
  const volume = Volume.parse((await saved(`[data-map=${format}]`)).bytes);
  const values = [...volume.intensities()];
  volume.free();
  return values;
}

const count = (values: number[], label: number) => values.filter((value) => value === label).length;

/** Opens a label map of the open volume. */
async function openMap(name: string, bytes: Uint8Array): Promise<void> {
  const chooser = app.page.locator('input[type=file]').nth(1);
  await chooser.setInputFiles({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(bytes) });
}

describe('the tooth', () => {
  test('opens with enamel, dentine and pulp, labelled as documented, and closed surfaces', async () => {
    await openAt('#segment');
    const file = Volume.parse(new Uint8Array(await readFile('www/public/data/tooth.nrrd')));
    const truth = labelTooth(file.intensities(), file.dims);
    file.free();
    const { labels } = await measured();
    expect(labels.map(({ name, value, voxels }) => [name, value, voxels])).toEqual([
      ['Enamel', 1, count([...truth], 1)],
      ['Dentine', 2, count([...truth], 2)],
      ['Pulp', 3, count([...truth], 3)],
    ]);
    for (const { volume, voxels, area, triangles, vertices } of labels) {
      expect(volume).toBeCloseTo(voxels);
      expect(area).toBeGreaterThan(4.8 * voxels ** (2 / 3));
      expect(triangles).toBeGreaterThan(vertices);
    }
    expect(await app.page.title()).toBe('Vesicle: Segment');
    expect(await text('.status')).toBe('Ready: 3 surfaces.');
    expect(await unnamedControls(app.page)).toEqual([]);
  });

  test('a stroke takes voxels from one label for another, and their surfaces change', async () => {
    const [enamel, dentine] = [await of(1), await of(2)];
    await tool('brush', 4);
    const view = app.page.locator('.scene canvas');
    const before = await view.screenshot();
    await followed(() => drag('Coronal', [-9, 2], [-4, 2]));
    const now = await of(1);
    expect(now.voxels).toBeGreaterThan(enamel.voxels + 100);
    expect(now.version).toBeGreaterThan(enamel.version);
    expect((await of(2)).voxels).toBeLessThan(dentine.voxels);
    await changes(app.page, before, () => view.screenshot(), 0, 'the surfaces');
    expect(await text('.status')).toMatch(/^3 surfaces, smooth \d+ ms after the change\.$/);
  });
});

describe('a volume without a label map', () => {
  beforeEach(openBall);

  test('begins with an empty map and one label, into which a stroke paints a surface', async () => {
    expect(await text('.facts')).toContain('empty');
    await tool('brush', 3);
    await followed(() => drag('Axial', [-6, 0], [6, 0]));
    const { voxels: painted, volume, area, vertices } = await of(1);
    // A ball of radius 3.5 mm, in voxels of 1 × 1 × 2 mm, along 12 mm.
    expect(painted).toBeGreaterThan(230);
    expect(painted).toBeLessThan(400);
    expect(volume).toBeCloseTo(2 * painted);
    expect(area).toBeGreaterThan(300);
    expect(vertices).toBeGreaterThan(200);
    expect(count(await voxels(), 1)).toBe(painted);
  });

  test('shows the labels on the slices', async () => {
    const slice = app.page.locator('.slice canvas[aria-label^="Coronal"]');
    const before = await slice.screenshot();
    await tool('brush', 5);
    await followed(() => drag('Axial', [-6, 0], [6, 0]));
    await changes(app.page, before, () => slice.screenshot(), 0.02, 'the coronal slice');
  });

  test('draws the outline of each visible surface on the slices, in the colour of its label', LONG, async () => {
    /** Returns the box of the pixels of a slice that have a colour, in voxels, and their number. */
    const colored = (slice: string, rgb: [number, number, number]) =>
      app.page.locator(`.slice canvas[aria-label^="${slice}"]`).evaluate(
        (canvas, [size, ...rgb]) => {
          const { width, height } = canvas as HTMLCanvasElement;
          const pixels = (canvas as HTMLCanvasElement).getContext('2d')?.getImageData(0, 0, width, height).data ?? [];
          const found: [number, number][] = [];
          for (let i = 0; i < width * height; i++)
            if (rgb.every((value, k) => Math.abs((pixels[4 * i + k] ?? 0) - value) < 12))
              found.push([i % width, Math.floor(i / width)]);
          const span = [0, 1].map((k) => {
            const all = found.map((at) => at[k] ?? 0);
            return (Math.max(...all) - Math.min(...all)) / (Math.min(width, height) / size);
          });
          return { count: found.length, span };
        },
        [SIZE, ...rgb] as [number, number, number, number],
      );
    const orange = () => colored('Axial', [230, 159, 0]);
    await app.page.fill('[data-view=opacity]', '0');
    await tool('brush', 5);
    await followed(() => drag('Axial', [-6, 0], [6, 0]));
    // The outline of the brush would cover that of the surface.
    await app.page.mouse.move(0, 0);
    const { count: pixels, span } = await orange();
    expect(pixels).toBeGreaterThan(100);
    // A ball of radius 5.5 voxels along 12 voxels; the line has a width.
    expect(span[0]).toBeGreaterThan(21);
    expect(span[0]).toBeLessThan(25);
    expect(span[1]).toBeGreaterThan(9.5);
    expect(span[1]).toBeLessThan(13);
    await app.page.uncheck('[data-view=outlines]');
    expect((await orange()).count).toBe(0);
    expect(await app.page.evaluate(() => location.hash)).toContain('outlines=false');
    await app.page.check('[data-view=outlines]');
    expect((await orange()).count).toBe(pixels);
    for (let i = 0; i < 8; i++) await app.page.keyboard.press('.');
    expect((await orange()).count).toBe(0);
    for (let i = 0; i < 8; i++) await app.page.keyboard.press(',');
    expect((await orange()).count).toBe(pixels);
    await app.page.click('[data-control=visible][data-value="1"]');
    expect((await orange()).count).toBe(0);
    await app.page.click('[data-control=visible][data-value="1"]');
    await tool('eraser', 3);
    await followed(() => drag('Axial', [0, 0]));
    expect((await orange()).count).toBeGreaterThan(pixels);
    await app.page.fill('[data-view=opacity]', '0.5');
  });

  test('undo and redo restore the voxels of each stroke, and the surfaces follow', async () => {
    await tool('brush', 2);
    await followed(() => drag('Axial', [-6, -4], [6, -4]));
    const first = await voxels();
    const before = await of(1);
    await followed(() => drag('Coronal', [0, -5], [0, 5]));
    const second = await voxels();
    expect(second).not.toEqual(first);
    await followed(() => app.page.keyboard.press('u'));
    expect(await voxels()).toEqual(first);
    const undone = await of(1);
    expect(undone.voxels).toBe(before.voxels);
    expect(undone.area / before.area).toBeCloseTo(1, 2);
    await followed(() => app.page.keyboard.press('Control+z'));
    expect(count(await voxels(), 1)).toBe(0);
    expect((await of(1)).vertices).toBe(0);
    for (let i = 0; i < 2; i++) await followed(() => app.page.keyboard.press('Control+y'));
    expect(await voxels()).toEqual(second);
    expect(await app.page.locator('[data-transport=redo]').isEnabled()).toBe(false);
  });

  test('the threshold brush paints only intensities of its range, whose voxels are shown before', async () => {
    const slice = app.page.locator('.slice canvas[aria-label^="Coronal"]');
    const before = await slice.screenshot();
    await tool('threshold', 12);
    await app.page.fill('[data-tool-setting=low]', '200');
    await app.page.fill('[data-tool-setting=high]', '300');
    await app.page.locator('[data-tool-setting=high]').blur();
    await changes(app.page, before, () => slice.screenshot(), 0.02, 'the mask');
    await followed(() => drag('Axial', [0, 0], [8, 0]));
    const [painted, intensities] = [await voxels(), ball()];
    expect(count(painted, 1)).toBeGreaterThan(500);
    expect(painted.every((label, i) => label === 0 || (intensities[i] ?? 0) >= 200)).toBe(true);
    // Voxels beside each other on both sides of the threshold are both under the brush.
    expect(painted.some((label, i) => label === 1 && (intensities[i] ?? 0) >= 200 && painted[i + 1] === 0)).toBe(true);
  });

  test('the eraser erases, and fill fills one area of a slice', LONG, async () => {
    await tool('brush', 2);
    await app.page.selectOption('[data-tool-setting=shape]', 'disc');
    // A square without its inside.
    await followed(() => drag('Axial', [-8, -8], [8, -8], [8, 8], [-8, 8], [-8, -8]));
    const outline = count(await voxels(), 1);
    await tool('fill');
    await followed(() => drag('Axial', [0, 0]));
    const filled = await voxels();
    expect(count(filled, 1)).toBeGreaterThan(outline + 80);
    // In one slice alone.
    const slices = new Set(filled.flatMap((label, i) => (label === 1 ? [Math.floor(i / SIZE ** 2)] : [])));
    expect([...slices]).toEqual([15]);
    await tool('eraser', 3);
    await followed(() => drag('Axial', [0, 0]));
    expect(count(await voxels(), 1)).toBeLessThan(count(filled, 1) - 20);
  });

  test(
    'fill in the volume reaches the inside of a label, or intensities in the range, and not beyond its distance',
    LONG,
    async () => {
      const [intensities, middle] = [ball(), 15 * (1 + SIZE + SIZE ** 2)];
      await tool('fill');
      await app.page.selectOption('[data-tool-setting=extent]', 'box');
      const slice = app.page.locator('.slice canvas[aria-label^="Coronal"]');
      const before = await slice.screenshot();
      await app.page.check('[data-tool-setting=in-range]');
      await app.page.fill('[data-tool-setting=low]', '128');
      await app.page.fill('[data-tool-setting=high]', '300');
      await app.page.locator('[data-tool-setting=high]').blur();
      await changes(app.page, before, () => slice.screenshot(), 0.02, 'the mask');
      await followed(() => app.page.keyboard.press('p'));
      const whole = await voxels();
      expect(whole).toEqual(Array.from(intensities, (value) => Number(value >= 128)));
      await followed(() => app.page.keyboard.press('u'));
      expect(count(await voxels(), 1)).toBe(0);
      await app.page.fill('[data-tool-setting=reach]', '3');
      await app.page.locator('[data-tool-setting=reach]').blur();
      await followed(() => app.page.keyboard.press('p'));
      expect(count(await voxels(), 1)).toBe(7 ** 3);
      await app.page.fill('[data-tool-setting=reach]', '100');
      await app.page.locator('[data-tool-setting=reach]').blur();
      await followed(() => app.page.keyboard.press('u'));
      await app.page.fill('[data-tool-setting=low]', '299');
      await app.page.locator('[data-tool-setting=low]').blur();
      await expect
        .poll(async () => {
          await app.page.keyboard.press('p');
          return text('.status');
        })
        .toMatch(/^Nothing to fill/);
      expect(count(await voxels(), 1)).toBe(0);
      const untinted = await slice.screenshot();
      await app.page.fill('[data-tool-setting=low]', '128');
      await app.page.locator('[data-tool-setting=low]').blur();
      await changes(app.page, untinted, () => slice.screenshot(), 0.02, 'the mask');
      // A cavity of another label, in a ball: the background around is not reached.
      await followed(() => app.page.keyboard.press('p'));
      await tool('eraser', 4);
      await app.page.selectOption('[data-tool-setting=shape]', 'ball');
      await followed(() => app.page.keyboard.press('p'));
      expect((await voxels())[middle]).toBe(0);
      await app.page.click('[data-label=add]');
      await tool('fill');
      await app.page.uncheck('[data-tool-setting=in-range]');
      await followed(() => app.page.keyboard.press('p'));
      const filled = await voxels();
      expect(filled.map((label) => Number(label > 0))).toEqual(whole);
      expect(filled[middle]).toBe(2);
      expect(count(filled, 2)).toBe((await of(2)).voxels);
      expect(count(filled, 2)).toBeGreaterThan(150);
      await app.page.selectOption('[data-tool-setting=extent]', 'slice');
    },
  );

  test('labels are added, named, coloured, hidden and removed, and other labels can be kept', async () => {
    await tool('brush', 4);
    await followed(() => drag('Axial', [-3, 0]));
    const alone = (await of(1)).voxels;
    await app.page.click('[data-label=add]');
    await app.page.fill('[data-control=name][data-value="2"]', 'Kidney');
    await app.page.locator('[data-control=name][data-value="2"]').press('Enter');
    await app.page.check('[data-tool-setting=protect]');
    await followed(() => drag('Axial', [0, 0]));
    expect((await of(1)).voxels).toBe(alone);
    expect(await of(2)).toMatchObject({ name: 'Kidney', value: 2 });
    const kept = (await of(2)).voxels;
    expect(kept).toBeGreaterThan(0);
    await app.page.uncheck('[data-tool-setting=protect]');
    await followed(() => drag('Axial', [0, 0]));
    expect((await of(2)).voxels).toBeGreaterThan(kept);
    expect((await of(1)).voxels).toBeLessThan(alone);
    const view = app.page.locator('.scene canvas');
    const before = await view.screenshot();
    await app.page.click('[data-control=visible][data-value="2"]');
    await changes(app.page, before, () => view.screenshot(), 0.001, 'the view');
    await followed(() => app.page.click('[data-control=remove][data-value="2"]'));
    expect((await measured()).labels.map(({ value }) => value)).toEqual([1]);
    expect(count(await voxels(), 2)).toBe(0);
    await followed(() => app.page.keyboard.press('u'));
    expect((await measured()).labels.map(({ name }) => name)).toEqual(['Label 1', 'Kidney']);
  });

  test('can be painted by keys alone', async () => {
    await app.page.locator('.scene canvas').focus();
    for (const key of ['b', ']', ']']) await app.page.keyboard.press(key);
    const radius = Number(await app.page.inputValue('[data-tool-setting=radius]'));
    await app.page.keyboard.press('[');
    expect(await app.page.inputValue('[data-tool-setting=radius]')).toBe(String(radius - 1));
    await followed(() => app.page.keyboard.press('p'));
    const { voxels: painted } = await of(1);
    expect(painted).toBeGreaterThan(10);
    // A second ball, one axial slice further.
    const axial = app.page.locator('.slice').getByLabel('Axial', { exact: true });
    const slice = Number(await axial.inputValue());
    await app.page.keyboard.press('.');
    expect(await axial.inputValue()).toBe(String(slice + 1));
    await followed(() => app.page.keyboard.press('p'));
    const both = (await of(1)).voxels;
    expect(both).toBeGreaterThan(painted);
    await app.page.keyboard.press(',');
    expect(await axial.inputValue()).toBe(String(slice));
    const canvas = app.page.locator('.slice canvas[aria-label^="Axial"]');
    expect(await canvas.getAttribute('aria-label')).toMatch(/Labels here: Label 1 \d+ voxels\./);
    await app.page.keyboard.press('e');
    await app.page.keyboard.press('[');
    await followed(() => app.page.keyboard.press('p'));
    expect((await of(1)).voxels).toBeLessThan(both);
  });
});

describe('files', () => {
  /** A label map of two boxes that touch. */
  const boxes = () =>
    Uint8Array.from({ length: SIZE ** 3 }, (_, i) => {
      const [x, y, z] = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2)];
      const inside = x > 5 && x < 26 && y > 8 && y < 20 && z > 10 && z < 22;
      return inside ? (x < 15 ? 3 : 7) : 0;
    });

  const values = async () => (await measured()).labels.map(({ value }) => value);

  // Open for all tests after the first.
  beforeEach(async () => {
    if (app.page.url().includes('#segment') && (await values()).join() === '3,7') return;
    await openBall();
    await drop(app.page, [
      { name: 'image.nii', bytes: ballFile() },
      { name: 'image-labels.nii', bytes: ballFile(boxes()) },
    ]);
    await expect.poll(values).toEqual([3, 7]);
    await reach(app.page, 'done');
  });

  test('a volume and its label map open together, with a surface for each label', async () => {
    expect(await text('.facts')).toContain('image-labels.nii');
    expect((await of(3)).voxels).toBe(count([...boxes()], 3));
    expect((await of(3)).volume).toBeCloseTo(2 * count([...boxes()], 3));
  });

  test('a volume that looks like a label map says so', async () => {
    for (const [name, bytes, note] of [
      ['boxes.nii', ballFile(boxes()), 'looks like a label map with 2 labels, and was opened as one'],
      ['two.nii', ballFile(boxes().map((label) => Math.min(label, 1))), 'looks like a mask'],
    ] as const) {
      await opened(() => drop(app.page, [{ name, bytes }]));
      expect(await text('.facts')).toContain(note);
    }
    // By its name, it is one.
    await opened(() =>
      drop(app.page, [{ name: 'mask.nii', bytes: ballFile(boxes().map((label) => Math.min(label, 1))) }]),
    );
    expect((await of(1)).voxels).toBe(boxes().filter((label) => label > 0).length);
  });

  for (const [format, options] of [
    ['nifti', LONG],
    ['nrrd', {}],
    ['mha', LONG],
  ] as const) {
    test(`a map saved as ${format} and opened again is the same, to the voxel`, options, async () => {
      const before = await measured();
      const { name, bytes } = await saved(`[data-map=${format}]`);
      expect(name).toMatch(/^image-labels\.(nii\.gz|seg\.nrrd|mha)$/);
      // Compressed: as a whole, or inside.
      expect([...bytes.subarray(0, 2)].join() === '31,139').toBe(format === 'nifti');
      expect(bytes.length).toBeLessThan(SIZE ** 3 / 8);
      const [map, image] = [Volume.parse(bytes), Volume.parse(ballFile())];
      expect(map.dims).toEqual(image.dims);
      expect([...map.intensities()]).toEqual([...boxes()]);
      if (map.space === image.space) expect([...map.affine]).toEqual([...image.affine]);
      map.free();
      image.free();
      await tool('eraser', 8);
      await followed(() => drag('Axial', [0, 0]));
      expect((await of(3)).voxels).toBeLessThan(before.labels[0]?.voxels ?? 0);
      await openMap(name, bytes);
      await expect.poll(async () => (await of(3)).voxels).toBe(before.labels[0]?.voxels);
      await reach(app.page, 'done');
      expect(await voxels()).toEqual([...boxes()]);
    });
  }

  test('names and colours are kept in NRRD files', LONG, async () => {
    const list = () =>
      app.page.$$eval('.labels li', (items) =>
        items.map((item) =>
          ['name', 'color'].map((control) => item.querySelector<HTMLInputElement>(`[data-control=${control}]`)?.value),
        ),
      );
    for (const [value, name, color] of [
      [3, 'Größe \\ 1', '#336699'],
      [7, 'Right: part', '#c0ffee'],
    ] as const) {
      await app.page.fill(`[data-control=name][data-value="${value}"]`, name);
      await app.page.locator(`[data-control=name][data-value="${value}"]`).press('Enter');
      await app.page.fill(`[data-control=color][data-value="${value}"]`, color);
    }
    const named = await list();
    expect(named).toEqual([
      ['Größe \\ 1', '#336699'],
      ['Right: part', '#c0ffee'],
    ]);
    const { name, bytes } = await saved('[data-map=nrrd]');
    await openMap('plain.nii', ballFile(boxes()));
    await expect.poll(async () => (await list())[0]?.[0]).toBe('Label 3');
    await reach(app.page, 'done');
    await openMap(name, bytes);
    await expect.poll(list).toEqual(named);
    await reach(app.page, 'done');
    // Both at once, the label map first: it is recognised by the names in it.
    await drop(app.page, [
      { name: 'a.nrrd', bytes },
      { name: 'b.nii', bytes: ballFile() },
    ]);
    await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('a.nrrd'));
    await reach(app.page, 'done');
    expect(await list()).toEqual(named);
    await drop(app.page, [
      { name: 'image.nii', bytes: ballFile() },
      { name: 'image-labels.nii', bytes: ballFile(boxes()) },
    ]);
    await expect.poll(async () => (await list())[0]?.[0]).toBe('Label 3');
    await reach(app.page, 'done');
  });

  test('surfaces are saved as one GLB with named nodes, and as a file for each label', async () => {
    await app.page.fill('[data-control=name][data-value="7"]', 'Left part');
    await app.page.locator('[data-control=name][data-value="7"]').press('Enter');
    const glb = await saved('[data-export=glb]');
    expect(glb.name).toMatch(/\.glb$/);
    const length = new DataView(glb.bytes.buffer, glb.bytes.byteOffset).getUint32(12, true);
    const { nodes } = JSON.parse(strFromU8(glb.bytes.subarray(20, 20 + length)));
    expect(nodes.flatMap(({ name }: { name?: string }) => name ?? [])).toEqual(['Label 3', 'Left part']);
    expect(nodes[0].extras).toMatchObject({ space: 'RAS' });
    for (const format of ['ply', 'stl', 'obj']) {
      const files = unzipSync((await saved(`[data-export=${format}]`)).bytes);
      expect(Object.keys(files)).toEqual([`3-Label-3.${format}`, `7-Left-part.${format}`]);
      const mesh = Mesh.parse(files[`7-Left-part.${format}`] ?? new Uint8Array());
      expect(mesh.check()).toMatchObject({ closed: true, selfIntersections: 0 });
      expect(mesh.info().volume / (await of(7)).volume).toBeCloseTo(1, 2);
      mesh.free();
    }
  });

  test('a map of another size, at another position, or of fractions is refused, and nothing changes', async () => {
    const before = await measured();
    const small = new Volume({ data: new Uint8Array(27), dims: [3, 3, 3] });
    const refused: [string, Uint8Array, RegExp][] = [
      ['small.nii', small.toBytes('nifti'), /3 × 3 × 3.*32 × 32 × 32/],
      ['moved.nii', ballFile(boxes(), [1, 1, 2.5]), /another position/],
      ['fractions.nii', ballFile(Float32Array.from(boxes(), (label) => label / 2)), /float|integer/],
    ];
    small.free();
    for (const [name, bytes, reason] of refused) {
      await openMap(name, bytes);
      await app.page.waitForSelector('[data-state=error]');
      expect(await text('.banner')).toMatch(reason);
      await app.page.click('.banner button');
      await reach(app.page, 'done');
      expect((await measured()).labels).toEqual(before.labels);
    }
    expect(await voxels()).toEqual([...boxes()]);
  });
});

describe('DICOM segmentations', () => {
  const [WIDE, HIGH, DEEP] = [20, 16, 12];
  const GRID = {
    dims: [WIDE, HIGH, DEEP] as [number, number, number],
    spacing: [1.2, 0.8, 2] as [number, number, number],
    origin: [-12.5, 31.25, 7.75] as [number, number, number],
    along: [0.8, 0.6, 0, -0.36, 0.48, 0.8] as [number, number, number, number, number, number],
  };

  /** Returns the labels of the files, computed as by the script that made them. */
  const expected = () =>
    Array.from({ length: WIDE * HIGH * DEEP }, (_, i) => {
      const [x, y, z] = [i % WIDE, Math.floor(i / WIDE) % HIGH, Math.floor(i / (WIDE * HIGH))];
      const squared = (x - 9) ** 2 + (y - 8) ** 2 + 2 * (z - 6) ** 2;
      if (squared < 36) return squared < 9 ? 2 : 1;
      return x >= 15 && x < 19 && y >= 2 && y < 13 && z >= 2 && z < 10 ? 3 : 0;
    });

  /** Returns the slices of the volume that the segmentations belong to. */
  const series = (more: Partial<typeof GRID> = {}) =>
    dicomSeries({ ...GRID, ...more, data: Uint16Array.from(expected(), (label) => 1000 + 100 * label) });

  const segmentation = async (name: string) =>
    new Uint8Array(await readFile(`tests/data/volumes/segmentation/${name}`));

  const names = async () => (await measured()).labels.map(({ name }) => name);

  async function openTogether(file: string, slices = series()): Promise<void> {
    const bytes = await segmentation(file);
    const dropped = slices.map(({ name, buffer }) => ({ name, bytes: new Uint8Array(buffer) }));
    await drop(app.page, [...dropped, { name: file, bytes }]);
  }

  for (const [file, options] of [
    ['binary.dcm', {}],
    ['overlap.dcm', LONG],
    ['fractional.dcm', LONG],
    ['labelmap.dcm', LONG],
  ] as const) {
    test(`${file} opens with its series: its labels are at their voxels, with names and colours`, options, async () => {
      await opened(() => openTogether(file));
      expect(await names()).toEqual(['Liver', 'Left kidney', 'Spleen']);
      const colors = await app.page.$$eval('[data-control=color]', (all) =>
        all.map((one) => (one as HTMLInputElement).value),
      );
      expect(colors).toEqual(['#dc8264', '#b96653', '#9d6ca2']);
      expect(await voxels()).toEqual(expected());
      expect((await of(3)).volume).toBeCloseTo(count(expected(), 3) * 1.2 * 0.8 * 2, 3);
      const shared = count(expected(), 2);
      if (file === 'overlap.dcm')
        expect(await text('[data-warning-list]')).toContain(`${shared} voxels are in several segments`);
    });
  }

  test('opens in the place of a label map, also for a volume whose axes have other directions', LONG, async () => {
    // The same grid in RAS, with x backwards: as after a conversion to NIfTI.
    const [x, y] = [GRID.along.slice(0, 3), GRID.along.slice(3)] as [number[], number[]];
    const normal = [0.48, -0.64, 0.6];
    const column = (way: number[], step: number) => [
      -step * (way[0] ?? 0),
      -step * (way[1] ?? 0),
      step * (way[2] ?? 0),
      0,
    ];
    const far = GRID.origin.map((from, axis) => from + (WIDE - 1) * 1.2 * (x[axis] ?? 0));
    const volume = new Volume({
      data: new Uint8Array(WIDE * HIGH * DEEP).map((_, i) => i % WIDE),
      dims: GRID.dims,
      affine: [
        ...column(x, -1.2),
        ...column(y, 0.8),
        ...column(normal, 2),
        -(far[0] ?? 0),
        -(far[1] ?? 0),
        far[2] ?? 0,
        1,
      ],
      space: 'RAS',
    });
    await opened(() => drop(app.page, [{ name: 'converted.nii', bytes: volume.toBytes('nifti') }]));
    volume.free();
    await openMap('binary.dcm', await segmentation('binary.dcm'));
    await expect.poll(names).toEqual(['Liver', 'Left kidney', 'Spleen']);
    await reach(app.page, 'done');
    const mirrored = expected().map((_, i, all) => all[i - (i % WIDE) + WIDE - 1 - (i % WIDE)]);
    expect(await voxels()).toEqual(mirrored);
  });

  test('is refused, and changes nothing, if it has another grid or extends beyond the volume', LONG, async () => {
    await opened(() => openTogether('binary.dcm'));
    const refused: [Partial<typeof GRID>, string, RegExp][] = [
      [{ spacing: [1.2, 0.9, 2] }, 'binary.dcm', /not voxels of the volume/],
      [{ origin: [-12, 31.25, 7.75] }, 'binary.dcm', /not voxels of the volume/],
      // Shifted by four slices.
      [{ origin: [-12.5 + 8 * 0.48, 31.25 - 8 * 0.64, 7.75 + 8 * 0.6] }, 'binary.dcm', /outside the volume/],
    ];
    for (const [more, file, reason] of refused) {
      await openTogether(file, series(more));
      await app.page.waitForSelector('[data-state=error]');
      expect(await text('.banner')).toMatch(reason);
      await app.page.click('.banner button');
      await reach(app.page, 'done');
      expect(await names()).toEqual(['Liver', 'Left kidney', 'Spleen']);
    }
    expect(await voxels()).toEqual(expected());
  });
});

test('a crash of the worker loses no stroke', LONG, async () => {
  const page = await anotherPage(app, () => {
    const { Worker } = window;
    class Breaking extends Worker {
      constructor(...given: ConstructorParameters<typeof Worker>) {
        super(...given);
        const crash = () => this.dispatchEvent(new ErrorEvent('error', { message: 'out of memory', cancelable: true }));
        Object.assign(window, { crash });
      }
    }
    Object.assign(window, { Worker: Breaking });
  });
  const first = app.page;
  app.page = page;
  try {
    await openAt('#segment?example=ovule');
    await openBall();
    await tool('brush', 4);
    await followed(() => drag('Axial', [-5, 0], [5, 0]));
    const painted = await voxels();
    await page.evaluate(() => (window as unknown as { crash: () => void }).crash());
    await page.waitForSelector('[data-state=error]');
    expect(await text('.banner')).toMatch(/Reset restarts the engine.*out of memory/);
    await page.click('[data-action=reset]');
    await reach(page, 'done');
    expect(await voxels()).toEqual(painted);
    expect((await of(1)).voxels).toBe(count(painted, 1));
  } finally {
    app.page = first;
    await page.close();
  }
});

test('what follows a change for long can be cancelled, and goes on after the next change', LONG, async () => {
  const { page } = app;
  await page.goto('about:blank');
  // Merging the edges takes one step of many seconds, which only the end of the worker ends.
  await page.goto(`${app.address}#segment?example=head&p.smoothing=200&p.edge=10`);
  const cancel = page.locator('[data-action=cancel]');
  await page.waitForSelector('[data-state=running]');
  await cancel.click();
  await expect.poll(() => page.textContent('.status')).toBe(STOPPED);
  expect(await reach(page, 'done')).toBe('done');
  expect(await cancel.isVisible()).toBe(false);
  const before = await measured();
  expect(before.labels.every(({ triangles }) => triangles > 0)).toBe(true);
  await unfold(page);
  await page.getByLabel('Edge length', { exact: true }).fill('1');
  await page.keyboard.press('Enter');
  await expect.poll(() => page.textContent('.status')).toMatch(/^Ready/);
  expect((await measured()).labels[0]?.area).toBeLessThan(before.labels[0]?.area ?? 0);
});

test('a step that does not end is cancelled with its worker, and the labels are there', LONG, async () => {
  const page = await anotherPage(app, () => {
    let isFirst = true;
    window.Worker = class extends Worker {
      readonly #isStuck = isFirst;
      override postMessage(message: { kind?: string }, ...more: never[]): void {
        isFirst = false;
        if (!this.#isStuck || message?.kind !== 'step') super.postMessage(message, ...more);
      }
    };
  });
  await page.goto(`${app.address}#segment?example=tooth`);
  await page.waitForSelector('[data-state=running]');
  await page.locator('[data-action=cancel]').click();
  await expect.poll(() => page.textContent('.status')).toBe(STOPPED);
  expect(await page.getAttribute('#lab', 'data-state')).toBe('done');
  const { labels } = JSON.parse((await page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
  expect(labels.map(({ voxels }: Measured) => voxels > 0)).toEqual([true, true, true]);
  await page.close();
});

test('settings are part of the link, and the page fits a phone', LONG, async () => {
  await openAt('#segment?example=ovule&opacity=0.8&slices=hidden&p.smoothing=5');
  expect(await app.page.inputValue('[data-view=opacity]')).toBe('0.8');
  expect(await app.page.inputValue('[data-view=slices]')).toBe('hidden');
  expect(await app.page.evaluate(() => location.hash)).toBe(
    '#segment?example=ovule&slices=hidden&opacity=0.8&p.smoothing=5',
  );
  for (const [width, height] of [
    [390, 844],
    [1024, 768],
    [1400, 900],
  ] as const)
    expect(await overflow(app.page, width, height)).toBeLessThanOrEqual(0);
});
