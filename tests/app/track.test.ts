/** The Track lab: a surface that is tracked through the frames of a 4D image. */
import { readFile } from 'node:fs/promises';
import { strFromU8, unzipSync } from 'three/addons/libs/fflate.module.js';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { cineVoxels } from '../../www/src/labs/track/cine';
import {
  type App,
  anotherPage,
  cancelAtOnce,
  drop,
  openApp,
  overflow,
  reach,
  recordNews,
  recordStates,
  unnamedControls,
} from './browser';
import { LONG } from './long';

let app: App;

/** Small enough to be tracked many times. */
const SMALL = { dims: [24, 24, 24], spacing: [2, 2, 2], frames: 4, noise: 4, size: 18, papillary: false } as const;
const spec = () => structuredClone(SMALL) as unknown as Parameters<typeof cineVoxels>[0];

beforeAll(async () => {
  await init();
  app = await openApp();
  // Looped playback would only slow the tests down; the test of playback turns it on.
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
});
afterAll(() => app.close());
afterEach(() => {
  expect(app.complaints.splice(0)).toEqual([]);
});

async function openAt(hash: string, ...states: string[]): Promise<void> {
  await app.page.goto('about:blank');
  await app.page.goto(app.address + hash);
  await reach(app.page, ...states);
}

async function measured(): Promise<Record<string, number | boolean>> {
  return JSON.parse((await app.page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
}

/** Waits until all frames have their surface and are displayed. */
async function tracked(frames: number): Promise<void> {
  await expect.poll(async () => [await state(), (await measured()).tracked]).toEqual(['done', frames]);
}

const text = async (selector: string) => (await app.page.locator(selector).first().textContent()) ?? '';
const hash = () => app.page.evaluate(() => location.hash);
const state = () => app.page.getAttribute('#lab', 'data-state');
const enabled = (selector: string) => app.page.locator(selector).isEnabled();
const shown = async () => (await measured()).frame;
const beat = async () => JSON.parse((await app.page.getAttribute('[data-beat]', 'data-beat')) ?? '{}');

/** Returns a 4D image as a file, and its frames as separate files. */
function small(): { film: Uint8Array; frames: Uint8Array[] } {
  const { dims, spacing, frames } = spec();
  const voxels = cineVoxels(spec());
  const size = voxels.length / frames;
  const bytes = (data: Uint8Array, count: number) => {
    const volume = new Volume({ data, dims: [...dims, count], spacing });
    const file = volume.toNifti();
    volume.free();
    return file;
  };
  const frame = (t: number) => bytes(voxels.slice(t * size, (t + 1) * size), 1);
  return { film: bytes(voxels, frames), frames: Array.from({ length: frames }, (_, t) => frame(t)) };
}

/** Tracks the whole of an image that is open, instead of an object in it. */
async function trackWhole(): Promise<void> {
  await app.page.click('[data-object=whole]');
}

/** Opens the small image, in the lab, and waits until all of it is tracked. */
async function dropSmall(): Promise<void> {
  if (!app.page.url().includes('#track')) await openAt('#track?example=ventricle', 'running', 'done');
  await drop(app.page, [{ name: 'small.nii', bytes: small().film }]);
  await app.page.waitForFunction(() => document.querySelector('.facts')?.textContent?.includes('small.nii'));
  await trackWhole();
  await reach(app.page, 'done');
}

/** Returns the file that a click downloads. */
async function saved(selector: string): Promise<{ name: string; bytes: Uint8Array }> {
  const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click(selector)]);
  return { name: download.suggestedFilename(), bytes: new Uint8Array(await readFile(await download.path())) };
}

describe('the computed ventricle', () => {
  test('is tracked through all frames by itself, near its known volumes', async () => {
    await openAt('#track?example=ventricle', 'done');
    const found = await measured();
    expect(found).toMatchObject({ tracked: 12, closed: true, oriented: true, crossings: 0, components: 1 });
    expect(found.errorMean).toBeLessThan(1);
    expect(found.closing).toBeLessThan(1);
    expect(await app.page.title()).toBe('Vesicle: Track');
    expect(await hash()).toBe('#track?example=ventricle');
    const { ejection, diastole, systole } = await beat();
    expect(ejection).toBeGreaterThan(0.58);
    expect(ejection).toBeLessThan(0.7);
    // The volume hardly changes from the end of the beat to its beginning.
    expect([10, 11, 0]).toContain(diastole);
    expect(systole).toBe(4);
  });

  test('what is being typed stays while an earlier change takes effect', async () => {
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    // At once, so that the change takes effect afterwards.
    await threshold.evaluate((field: HTMLInputElement) => {
      field.focus();
      field.value = '40';
      field.dispatchEvent(new Event('change'));
      field.value = '48.5';
    });
    await expect.poll(hash).toContain('p.threshold=40');
    await reach(app.page, 'done');
    expect(await threshold.inputValue()).toBe('48.5');
    // Without a change, the field shows what is in force when it is left.
    await threshold.fill('40');
    await threshold.blur();
    expect(await threshold.inputValue()).toBe('40');
    await threshold.fill('48.5');
    await threshold.press('Enter');
    await expect.poll(hash).toContain('p.threshold=48.5');
    await openAt('#track?example=ventricle', 'done');
  });

  test('describes the curve in words, together with the truth', async () => {
    // The text is updated when the curve is drawn, in the next animation frame.
    const words = /^End-diastole \(ED\) in frame \d+: [\d.]+ ml; end-systole .* Ground truth: /;
    await expect.poll(() => text('[data-beat]')).toMatch(words);
    expect(await text('.status')).toMatch(/^Done: all 12 frames tracked\. Ejection fraction [\d.]+ %\.$/);
    expect(await app.page.locator('.results table').first().locator('tbody tr').count()).toBe(12);
  });

  test('shows each frame, by slider, button and key, and plays in a loop', async () => {
    const volumes = new Set<unknown>();
    for (const frame of [0, 4]) {
      await app.page.locator('.frames input[type=range]').fill(String(frame));
      await expect.poll(shown).toBe(frame + 1);
      volumes.add((await measured()).volume);
    }
    expect(volumes.size).toBe(2);
    await app.page.click('[data-frame=next]');
    await expect.poll(shown).toBe(6);
    await app.page.locator('body').press(',');
    await expect.poll(shown).toBe(5);
    await app.page.click('[data-frame=beat]');
    await expect.poll(shown).not.toBe(5);
    await app.page.click('[data-frame=beat]');
    await expect.poll(() => text('[data-frame=beat]')).toBe('Loop');
    // The progress stays full while other frames are shown.
    expect(await app.page.locator('.transport progress').getAttribute('value')).toBe('1');
  });

  test('has votes on its surface and pictures below', async () => {
    await app.page.selectOption('[data-view=below]', 'boundary');
    const stills = app.page.locator('[data-stills]');
    await expect.poll(async () => Number(await stills.getAttribute('data-votes'))).toBeGreaterThan(1000);
    await app.page.selectOption('[data-view=below]', 'time');
    await expect.poll(async () => Number(await stills.getAttribute('data-crossings'))).toBeGreaterThanOrEqual(24);
    await app.page.selectOption('[data-view=below]', 'between');
    await expect.poll(async () => stills.getAttribute('data-between')).toMatch(/\d/);
    expect(await hash()).toContain('below=between');
    await app.page.selectOption('[data-view=below]', 'slices');
    await expect.poll(() => app.page.locator('.slices').isVisible()).toBe(true);
  });

  test('is compared with the run without prediction', async () => {
    await app.page.click('summary:has-text("Compare settings")');
    await app.page.selectOption('[data-compare=with]', 'prediction');
    await app.page.click('[data-compare=start]');
    const runs = async () =>
      JSON.parse((await app.page.getAttribute('[data-comparison]', 'data-comparison')) ?? '{}') as {
        name: string;
        steps: number;
        error: number;
      }[];
    await expect.poll(async () => (await runs()).length).toBe(2);
    const [present, other] = await runs();
    expect([present?.name, other?.name]).toEqual(['with prediction', 'without prediction']);
    expect(other?.steps).toBeGreaterThanOrEqual(present?.steps ?? 0);
    expect(other?.error).toBeLessThan(1);
    await expect.poll(() => text('[data-beat]')).toContain('without prediction:');
    expect(await state()).toBe('done');
  });

  test('all controls have names, and it fits a phone', async () => {
    expect(await unnamedControls(app.page)).toEqual([]);
    expect(await overflow(app.page, 390, 844)).toBeLessThanOrEqual(0);
    await app.page.setViewportSize({ width: 1280, height: 800 });
  });
});

describe('the user’s own image', () => {
  beforeAll(() => dropSmall());

  test('is enriched with slices if they help, and tracked', async () => {
    expect(await measured()).toMatchObject({ frames: 4, tracked: 4, closed: true, crossings: 0 });
    expect(await hash()).toContain('file=small.nii');
  });

  test('can be opened as its frames', async () => {
    const { frames } = small();
    const files = frames.map((bytes, i) => ({ name: `t${i + 1}.nii`, bytes }));
    const before = (await measured()).volume;
    await drop(app.page, files.reverse());
    await expect.poll(() => text('.facts')).toContain(' + 3');
    await trackWhole();
    await tracked(4);
    expect((await measured()).volume).toBe(before);
  });

  test('is refused if it has one frame, and the previous one is kept', async () => {
    const [first] = small().frames;
    await drop(app.page, [{ name: 'still.nii', bytes: first as Uint8Array }]);
    await expect.poll(state).toBe('error');
    expect(await text('.banner')).toMatch(/still\.nii could not be opened\..*at least two frames/);
    await app.page.click('.banner button');
    await expect.poll(state).toBe('done');
    expect((await measured()).tracked).toBe(4);
  });
});

describe('changes', () => {
  beforeAll(() => dropSmall());

  test('of the edge threshold restart tracking, and can be undone and redone', async () => {
    const { volume } = await measured();
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    await threshold.fill('80');
    await threshold.press('Enter');
    await expect.poll(hash).toContain('p.threshold=80');
    await tracked(4);
    const changed = (await measured()).volume;
    expect(changed).not.toBe(volume);
    await expect.poll(() => enabled('[data-transport=undo]')).toBe(true);
    await app.page.click('[data-transport=undo]');
    await expect.poll(async () => (await measured()).volume).toBe(volume);
    await expect.poll(hash).not.toContain('p.threshold');
    await expect.poll(() => enabled('[data-transport=redo]')).toBe(true);
    await app.page.click('[data-transport=redo]');
    await expect.poll(async () => (await measured()).volume).toBe(changed);
    await expect.poll(() => enabled('[data-transport=undo]')).toBe(true);
    await app.page.click('[data-transport=undo]');
    await expect.poll(async () => (await measured()).volume).toBe(volume);
  });

  test('to the value in force keep the tracked surfaces', async () => {
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    await threshold.fill('80');
    await threshold.press('Enter');
    await expect.poll(hash).toContain('p.threshold=80');
    await tracked(4);
    const states = await recordStates(app.page);
    await threshold.fill('80.0');
    await threshold.press('Enter');
    await expect.poll(() => threshold.inputValue()).toBe('80');
    expect(await measured()).toMatchObject({ frames: 4, tracked: 4 });
    expect(await states()).toEqual([]);
  });

  test('that are invalid are refused beside their control', async () => {
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    const before = await threshold.inputValue();
    await threshold.fill('-3');
    await threshold.press('Enter');
    await expect.poll(() => text('[data-param=threshold] .field-error')).toMatch(/\S/);
    expect(await threshold.inputValue()).toBe(before);
  });

  test('to an edge threshold above any step stop the run and report the largest', async () => {
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    await threshold.fill('250');
    await threshold.press('Enter');
    await expect.poll(() => text('.banner')).toMatch(/The run failed\..*largest step/);
    await app.page.click('.banner button');
    await expect.poll(() => enabled('[data-transport=undo]')).toBe(true);
    await app.page.click('[data-transport=undo]');
    await tracked(4);
  });

  test('to a threshold within the noise show a warning', LONG, async () => {
    const warning = () => text('[data-param=threshold] .warning');
    expect(await warning()).toBe('');
    const threshold = app.page.locator('[data-param=threshold] input[type=number]');
    await threshold.fill('5');
    await threshold.press('Enter');
    await expect.poll(warning).toMatch(/^Below 2\.5 σ/);
    await app.page.click('[data-threshold=suggest]');
    await expect.poll(warning).toBe('');
    await tracked(4);
  });

  test('of the box make a new tracker of those voxels', async () => {
    const last = app.page.locator('[data-box="2-last"]');
    await last.fill('14');
    await last.press('Enter');
    await expect.poll(hash).toContain('box=');
    await tracked(4);
    expect(await last.inputValue()).toBe('14');
    await app.page.click('[data-box=whole]');
    await expect.poll(hash).toContain('box=whole');
    await tracked(4);
  });

  test('of the box are made by dragging its sides on a slice', LONG, async () => {
    const slice = app.page.locator('.slice canvas').first();
    await slice.scrollIntoViewIfNeeded();
    const box = await slice.boundingBox();
    if (!box) throw new Error('there is no slice');
    const before = await app.page.locator('[data-box="0-first"]').inputValue();
    // The image is a square in the centre of its canvas; the patient's right is on the left.
    const [middle, half] = [box.x + box.width / 2, Math.min(box.width, box.height) / 2];
    await app.page.mouse.move(middle - half + 2, box.y + box.height / 2);
    await app.page.mouse.down();
    await app.page.mouse.move(middle - half / 2, box.y + box.height / 2, { steps: 4 });
    await app.page.mouse.up();
    await expect.poll(hash).toContain('box=');
    await tracked(4);
    const ends = ['0-first', '0-last'].map((end) => app.page.locator(`[data-box="${end}"]`).inputValue());
    const [first, last] = (await Promise.all(ends)).map(Number);
    expect(before).toBe('0');
    expect((last ?? 0) - (first ?? 0)).toBe(17);
    await app.page.click('[data-box=whole]');
    await expect.poll(hash).toContain('box=whole');
    await tracked(4);
  });

  test('of the preparation show the prepared image', async () => {
    await app.page.click('summary:has-text("Preparation")');
    await app.page.selectOption('[data-prepare=binning]', '2');
    await expect.poll(hash).toContain('binning=2');
    await tracked(4);
    expect(await app.page.locator('[data-box="0-last"]').inputValue()).toBe('11');
    await expect.poll(() => enabled('[data-transport=undo]')).toBe(true);
    await app.page.click('[data-transport=undo]');
    await expect.poll(() => app.page.locator('[data-box="0-last"]').inputValue()).toBe('23');
    await expect.poll(async () => (await measured()).tracked).toBe(4);
  });

  test('reset returns to before the first step; steps and play continue from there', async () => {
    await app.page.click('text=Reset');
    await expect.poll(async () => [await state(), (await measured()).tracked]).toEqual(['paused', 0]);
    await app.page.click('text="Step"');
    await expect.poll(() => text('.iteration')).toBe('Iteration 1');
    await app.page.click('text="Step ×10"');
    await expect.poll(async () => (await measured()).tracked).toBe(4);
    expect(await text('.iteration')).toBe('Iteration 8');
  });
});

describe('saving', () => {
  beforeAll(() => dropSmall());

  test('the displayed frame', async () => {
    await app.page.locator('.frames input[type=range]').fill('2');
    await expect.poll(shown).toBe(3);
    const { name, bytes } = await saved('[data-export=ply]');
    expect(name).toBe('small-3.ply');
    const mesh = Mesh.parse(bytes);
    expect(mesh.info().volume).toBeCloseTo(Number((await measured()).volume), -1);
    mesh.free();
  });

  test('all frames, each as a file', async () => {
    const { name, bytes } = await saved('[data-action=save-frames]');
    expect(name).toBe('small.zip');
    const files = unzipSync(bytes);
    expect(Object.keys(files)).toEqual(['frame-1.ply', 'frame-2.ply', 'frame-3.ply', 'frame-4.ply']);
    expect(strFromU8(files['frame-1.ply']?.subarray(0, 3) ?? new Uint8Array())).toBe('ply');
  });

  test('the beat as an animation, and the table of frames', async () => {
    const glb = await saved('[data-action=save-animation]');
    expect(new TextDecoder().decode(glb.bytes.subarray(0, 4))).toBe('glTF');
    const csv = await saved('[data-action=save-table]');
    expect(new TextDecoder().decode(csv.bytes).trim().split('\n')).toHaveLength(5);
  });
});

describe('links', () => {
  test('restore parameters, preparation, box and displayed items', async () => {
    const there =
      '#track?example=ventricle&binning=2&below=time&box=10,10,10,60,60,60&at=largest&p.threshold=70&p.prediction=false';
    await openAt(there, 'done');
    expect(new Set((await hash()).split(/[?&]/))).toEqual(new Set(there.split(/[?&]/)));
    expect(await app.page.locator('[data-param=prediction] input').isChecked()).toBe(false);
    expect(await app.page.locator('[data-param=threshold] input[type=number]').inputValue()).toBe('70');
  });

  test('with invalid settings are followed without them', LONG, async () => {
    await openAt('#track?example=ventricle&p.threshold=-1', 'running', 'done');
    await expect.poll(() => text('.banner')).toContain('The link’s settings were ignored.');
  });
});

test('passes the surface of a frame to the Sculpt lab, and is restored on the way back', LONG, async () => {
  await openAt('#track?example=ventricle&binning=2', 'done');
  await app.page.click('[data-action=sculpt]');
  await expect.poll(() => app.page.title()).toBe('Vesicle: Sculpt');
  await expect.poll(state).toMatch(/running|done/);
  await expect.poll(() => text('.facts')).toContain('ventricle (frame 12)');
  await app.page.click('[data-lab=track]');
  await expect.poll(() => app.page.title()).toBe('Vesicle: Track');
  await expect.poll(hash).toBe('#track?example=ventricle&binning=2');
  await tracked(12);
});

test('can be cancelled while an image is being opened, which restores the previous one', async () => {
  const news = await recordNews(app.page);
  await cancelAtOnce(app.page);
  const before = await text('.facts');
  await app.page.selectOption('.data select', 'thick-slices');
  await expect.poll(news).toContainEqual('Cancelled.');
  await expect.poll(state).toMatch(/running|done/);
  expect(await text('.facts')).toBe(
    before.replace(/Opening time.*$/, (await text('.facts')).match(/Opening time.*$/)?.[0] ?? ''),
  );
  expect(await app.page.locator('.banner').isVisible()).toBe(false);
});

test('can be paused at any time, and a new image ends the run', async () => {
  // From inside the page: a fast machine is done before a click from outside arrives.
  await app.page.evaluate(() => {
    const press = () => {
      const runs = document.querySelector('.facts')?.textContent?.includes('heart');
      const pause = [...document.querySelectorAll('button')].find((button) => button.textContent?.trim() === 'Pause');
      if (runs && pause) pause.click();
      else requestAnimationFrame(press);
    };
    press();
  });
  await app.page.selectOption('.data select', 'heart');
  await expect
    .poll(async () => [await state(), await text('.facts')])
    .toEqual(['paused', expect.stringContaining('heart')]);
  expect((await measured()).tracked).toBeLessThan(20);
  await app.page.click('text="Play"');
  await expect.poll(state).toBe('running');
  await dropSmall();
  await tracked(4);
});

test('while the frame is dragged, one request for votes waits for its answer, and then the frame shown gets its own', async () => {
  const page = await anotherPage(app, () => {
    const { postMessage } = Worker.prototype;
    const sent: number[] = [];
    const held: (() => void)[] = [];
    Object.assign(window, { votes: { sent, release: () => held.splice(0).map((send) => send()) } });
    // Holds requests for votes back, as a worker that is busy would.
    Worker.prototype.postMessage = function (this: Worker, ...given: Parameters<typeof postMessage>) {
      const [message] = given;
      if (message?.kind !== 'votes') return postMessage.apply(this, given);
      sent.push(message.body.frame);
      held.push(() => postMessage.apply(this, given));
    } as typeof postMessage;
  });
  const votes = <Result>(get: (votes: { sent: number[]; release: () => void }) => Result) =>
    page.evaluate(`(${get})(window.votes)`) as Promise<Result>;
  await page.goto(`${app.address}#track?example=ventricle`);
  await reach(page, 'done');
  const displayed = async () =>
    JSON.parse((await page.getAttribute('[data-measures]', 'data-measures')) ?? '{}').frame as number;
  const show = async (frame: number) => {
    await page.locator('.frames input[type=range]').fill(String(frame));
    await expect.poll(displayed).toBe(frame + 1);
  };
  await show(0);
  await page.selectOption('[data-view=below]', 'boundary');
  await expect.poll(() => votes(({ sent }) => sent)).toEqual([0]);
  for (const frame of [1, 2, 3, 4, 5]) await show(frame);
  expect(await votes(({ sent }) => sent)).toEqual([0]);
  await votes(({ release }) => release());
  await expect.poll(() => votes(({ sent }) => sent)).toEqual([0, 5]);
  await votes(({ release }) => release());
  await expect.poll(async () => Number(await page.getAttribute('[data-stills]', 'data-votes'))).toBeGreaterThan(0);
  await page.close();
});
