import type { Locator } from 'playwright-core';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Volume } from '../../pkg/index.js';
import { type App, afterRun, drop, measures, open, openApp, QUICK, reach, unfold } from './browser';
import { LONG } from './long';
import { countPixels } from './pixels';

/** Voxels along each side of the volume. */
const SIZE = 32;
/** A voxel in the axial slice at the centre, and its intensity. */
const KNOWN: [number, number, number] = [20, 12, 15];
const INTENSITY = -321.5;

let app: App;

/** Returns a ball of soft tissue in air, in Hounsfield units, with one voxel of a known intensity. */
function tissue(): Uint8Array {
  const data = Float32Array.from({ length: SIZE ** 3 }, (_, i) => {
    const [x, y, z] = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2)];
    return Math.max(-1000, Math.min(60, 100 * (10 - Math.hypot(x - 15.5, y - 15.5, z - 15.5))));
  });
  data[(KNOWN[2] * SIZE + KNOWN[1]) * SIZE + KNOWN[0]] = INTENSITY;
  return new Volume({
    data,
    dims: [SIZE, SIZE, SIZE],
    affine: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, -7, 0, 5, 1],
  }).toNifti();
}

const axial = () => app.page.locator('.slice canvas[aria-label^="Axial"]');
const readout = () => app.page.textContent('[data-readout]');

/** Returns the centre of a voxel on the axial slice as it is at first, in CSS pixels of the page. */
async function positionOf([x, y]: readonly number[]): Promise<[number, number]> {
  const box = await axial().boundingBox();
  if (!box) throw new Error('no slice');
  const scale = Math.min(box.width, box.height) / SIZE;
  // Right and front are on the left and at the top.
  const along = (index: number) => (SIZE / 2 - 0.5 - index) * scale;
  return [box.x + box.width / 2 + along(x ?? 0), box.y + box.height / 2 + along(y ?? 0)];
}

/** Returns the grey value that a canvas shows at a position of the page. */
async function greyAt(canvas: Locator, [x, y]: readonly [number, number]): Promise<number> {
  return canvas.evaluate(
    (element: HTMLCanvasElement, [left, top]) => {
      const box = element.getBoundingClientRect();
      const scale = element.width / box.width;
      const pixel = element.getContext('2d')?.getImageData((left - box.left) * scale, (top - box.top) * scale, 1, 1);
      return pixel?.data[0] ?? -1;
    },
    [x, y] as const,
  );
}

beforeAll(async () => {
  await init();
  app = await openApp(undefined, `#${QUICK.extract}`);
  await reach(app.page, 'done');
  await drop(app.page, [{ name: 'tissue.nii', bytes: tissue() }]);
  await app.page.locator('.facts', { hasText: 'tissue.nii' }).waitFor();
  await reach(app.page, 'done');
  await app.page.locator('.slice-bar summary').click();
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

describe('the readout', () => {
  test('shows position and exact intensity of the voxel under the pointer', async () => {
    await app.page.mouse.move(...(await positionOf(KNOWN)));
    await expect.poll(readout).toBe('Pointer: voxel 20, 12, 15 · RAS 33, 24, 35 · intensity -321.5');
  });

  test('shows the crosshair when the pointer has left, and its slider says the intensity', async () => {
    const sliders = app.page.locator('.slice').getByRole('slider');
    for (const [name, axis] of [
      ['Sagittal', 0],
      ['Coronal', 1],
      ['Axial', 2],
    ] as const)
      await app.page.locator('.slice').getByLabel(name, { exact: true }).fill(String(KNOWN[axis]));
    await app.page.mouse.move(5, 5);
    await expect.poll(readout).toBe('Crosshair: voxel 20, 12, 15 · RAS 33, 24, 35 · intensity -321.5');
    for (const slider of await sliders.all())
      expect(await slider.getAttribute('aria-valuetext')).toMatch(/; intensity -321\.5 at the crosshair$/);
  });
});

describe('contrast', () => {
  const window = () => app.page.locator('[data-slices=width]').inputValue().then(Number);
  const level = () => app.page.locator('[data-slices=level]').inputValue().then(Number);
  const choose = (label: string) => app.page.getByLabel('Contrast', { exact: true }).selectOption({ label });

  test('offers windows of computed tomography, which change the displayed grey values', async () => {
    const at = await positionOf([15, 6]);
    await choose('soft tissue (CT)');
    expect([await window(), await level()]).toEqual([400, 50]);
    await choose('whole range');
    const whole = await greyAt(axial(), at);
    await choose('soft tissue (CT)');
    expect(whole).toBeGreaterThan(0);
    await expect.poll(() => greyAt(axial(), at)).toBeLessThan(whole);
  });

  test('is changed by a drag with the right button, to wider or darker', async () => {
    await choose('whole range');
    const [width, middle] = [await window(), await level()];
    const at = await positionOf([15, 8]);
    const grey = await greyAt(axial(), at);
    const [x, y] = await positionOf([16, 16]);
    const crosshair = await app.page.getByRole('slider', { name: 'Sagittal' }).inputValue();
    await app.page.mouse.move(x, y);
    await app.page.mouse.down({ button: 'right' });
    await app.page.mouse.move(x + 30, y + 60, { steps: 4 });
    await app.page.mouse.up({ button: 'right' });
    expect(await window()).toBeGreaterThan(1.1 * width);
    expect(await level()).toBeGreaterThan(middle + 100);
    expect(await greyAt(axial(), at)).toBeLessThan(grey - 20);
    expect(await app.page.getByRole('slider', { name: 'Sagittal' }).inputValue()).toBe(crosshair);
    expect(await app.page.getByLabel('Contrast', { exact: true }).inputValue()).toBe('custom');
  });

  test('is changed by a drag with the main button, too, if the box is checked', async () => {
    await choose('whole range');
    const width = await window();
    const [x, y] = await positionOf([16, 16]);
    await app.page.getByLabel('Drag changes contrast').check();
    await app.page.mouse.move(x, y);
    await app.page.mouse.down();
    await app.page.mouse.move(x - 40, y, { steps: 3 });
    await app.page.mouse.up();
    await app.page.getByLabel('Drag changes contrast').uncheck();
    expect(await window()).toBeLessThan(0.9 * width);
  });

  test('refuses a window that is not above 0, and keeps the one in force', async () => {
    await choose('soft tissue (CT)');
    const field = app.page.locator('[data-slices=width]');
    await field.fill('-5');
    await field.press('Enter');
    await expect.poll(() => app.page.textContent('.slice-bar .field-error')).toContain('must be a number above 0');
    expect(await window()).toBe(400);
    await field.fill('500');
    await field.press('Enter');
    expect(await app.page.textContent('.slice-bar .field-error')).toBe('');
    expect([await window(), await level()]).toEqual([500, 50]);
  });

  test('offers no windows of tomography where intensities cannot be Hounsfield units', async () => {
    const options = () => app.page.getByLabel('Contrast', { exact: true }).locator('option').allTextContents();
    expect((await options()).join()).toContain('CT');
    await open(app, QUICK.extract);
    await reach(app.page, 'done');
    await app.page.locator('.slice-bar summary').click();
    expect(await options()).toEqual(['suggested', 'whole range', 'custom']);
  });
});

describe('zoom', () => {
  const voxel = async () => /voxel ([\d, ]+) /.exec((await readout()) ?? '')?.[1];

  test('keeps the voxel under the pointer, and a double click resets it', async () => {
    const box = await axial().boundingBox();
    const [x, y] = [(box?.x ?? 0) + 70, (box?.y ?? 0) + 60];
    await app.page.mouse.move(x, y);
    const before = await voxel();
    const reset = app.page.getByRole('button', { name: 'Reset zoom' });
    expect(await reset.isDisabled()).toBe(true);
    for (let i = 0; i < 5; i++) await app.page.mouse.wheel(0, -120);
    await expect.poll(() => reset.isDisabled()).toBe(false);
    await app.page.mouse.move(x + 1, y);
    await app.page.mouse.move(x, y);
    expect(await voxel()).toBe(before);
    // Magnified, a pixel further is still in the same voxel; 60 pixels would be many voxels further at first.
    await app.page.mouse.move(x + 3, y);
    expect(await voxel()).toBe(before);
    await app.page.mouse.dblclick(x, y);
    await expect.poll(() => reset.isDisabled()).toBe(true);
  });

  test('Shift and a drag pans: the voxel stays under the pointer', async () => {
    const box = await axial().boundingBox();
    const [x, y] = [(box?.x ?? 0) + 100, (box?.y ?? 0) + 100];
    await app.page.mouse.move(x, y);
    for (let i = 0; i < 4; i++) await app.page.mouse.wheel(0, -120);
    await app.page.mouse.move(x + 1, y);
    const before = await voxel();
    await app.page.keyboard.down('Shift');
    await app.page.mouse.down();
    await app.page.mouse.move(x + 41, y - 20, { steps: 4 });
    await app.page.mouse.up();
    await app.page.keyboard.up('Shift');
    expect(await voxel()).toBe(before);
    await app.page.mouse.move(x + 1, y);
    expect(await voxel()).not.toBe(before);
  });

  test('keys zoom about the crosshair and reset; the slider keeps its value', async () => {
    const reset = app.page.getByRole('button', { name: 'Reset zoom' });
    await reset.click();
    const slider = app.page.getByRole('slider', { name: 'Axial' });
    const value = await slider.inputValue();
    await slider.press('+');
    await expect.poll(() => reset.isDisabled()).toBe(false);
    await slider.press('Shift+ArrowRight');
    await slider.press('0');
    await expect.poll(() => reset.isDisabled()).toBe(true);
    expect(await slider.inputValue()).toBe(value);
    await slider.press('?');
    const listed = app.page.locator('dialog[open] dd:visible');
    await expect.poll(() => listed.allTextContents()).toContain('move a slice');
    await app.page.keyboard.press('Escape');
  });
});

describe('a cut', LONG, () => {
  test('hides half of the surface, along the slice of the crosshair', async () => {
    await open(app, QUICK.extract);
    await reach(app.page, 'done');
    await unfold(app.page);
    await app.page.locator('[data-view=slices]').selectOption('hidden');
    const view = app.page.locator('.scene > canvas');
    // The surface is of the colour of bone, cut faces are darker.
    const bone = async () => countPixels(app.page, await view.screenshot(), (r, g, b) => r > g && g > b && r - b > 18);
    const whole = await bone();
    const cut = app.page.getByLabel('Cut away');
    await cut.selectOption({ label: 'above the axial slice' });
    const slider = app.page.getByRole('slider', { name: 'Axial' });
    await slider.press('Home');
    await expect.poll(bone).toBeLessThan(0.2 * whole);
    await slider.press('End');
    await expect.poll(bone).toBeGreaterThan(0.9 * whole);
    await cut.selectOption({ label: 'below the axial slice' });
    await expect.poll(bone).toBeLessThan(0.2 * whole);
    await cut.selectOption({ label: 'nothing' });
    await expect.poll(bone).toBeGreaterThan(0.9 * whole);
  });
});

describe('frames of a 4D volume', () => {
  const RADII = [11, 9, 7];
  /** Returns frames with a ball each, of different radii. */
  const beating = () => {
    const data = Uint8Array.from({ length: SIZE ** 3 * RADII.length }, (_, i) => {
      const [x, y, z] = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2) % SIZE];
      const radius = RADII[Math.floor(i / SIZE ** 3)] ?? 0;
      return Math.max(0, Math.min(255, 128 + 40 * (radius - Math.hypot(x - 15.5, y - 15.5, z - 15.5))));
    });
    return new Volume({ data, dims: [SIZE, SIZE, SIZE, RADII.length], spacing: [1, 1, 1] }).toNifti();
  };
  /** Returns the frame whose ball has about the radius of the surface. */
  const frameOfSurface = async () => {
    const radius = Math.cbrt((await measures(app.page)).volume / ((4 / 3) * Math.PI));
    return RADII.findIndex((one) => Math.abs(one - radius) < 0.6);
  };
  const slider = () => app.page.locator('[data-param=frame]').getByRole('slider', { name: 'Frame' });
  const linkTo = (frame: number) => `extract?file=beating.nii&frame=${frame}&p.iso=128&p.damping=0.7`;
  const dropBeating = () => drop(app.page, [{ name: 'beating.nii', bytes: beating() }]);

  test('the first opens, and the slider chooses another, with the settings and the slices as they are', async () => {
    await open(app, QUICK.extract);
    await reach(app.page, 'done');
    expect(await slider().isVisible()).toBe(false);
    await afterRun(app.page, dropBeating);
    expect(await app.page.textContent('[data-param=frame] output')).toBe('1 of 3');
    expect(await frameOfSurface()).toBe(0);
    const damping = app.page.locator('[data-param=damping] input[type=number]');
    await afterRun(app.page, async () => {
      await damping.fill('0.7');
      await damping.press('Enter');
    });
    const axialSlider = app.page.getByRole('slider', { name: 'Axial' });
    await axialSlider.fill('9');
    await afterRun(app.page, () => slider().press('End'));
    expect(await frameOfSurface()).toBe(2);
    expect(await app.page.textContent('[data-param=frame] output')).toBe('3 of 3');
    expect(await damping.inputValue()).toBe('0.7');
    expect(await axialSlider.inputValue()).toBe('9');
    expect(app.page.url()).toContain('frame=2');
  });

  test('a link names the frame, which opens with the file', LONG, async () => {
    await open(app, linkTo(2));
    await reach(app.page, 'done');
    await afterRun(app.page, dropBeating);
    expect(await app.page.textContent('[data-param=frame] output')).toBe('3 of 3');
    expect(await frameOfSurface()).toBe(2);
  });

  test('a link to a frame that does not exist is refused with a reason, and the first frame opens', LONG, async () => {
    await open(app, linkTo(7));
    await reach(app.page, 'done');
    await dropBeating();
    await expect.poll(() => app.page.textContent('.banner')).toContain('settings were ignored');
    expect(await app.page.textContent('.banner')).toContain('frame');
    await expect.poll(() => app.page.textContent('[data-param=frame] output')).toBe('1 of 3');
  });
});
