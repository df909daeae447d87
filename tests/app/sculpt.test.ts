/** The Sculpt lab: ellipsoids move, and a detailed surface follows. */
import { readFile } from 'node:fs/promises';
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { ball, dracoGlb, dracoStream } from '../js/made-gltf';
import {
  type App,
  afterRun,
  anotherPage,
  drop,
  openApp,
  overflow,
  reach,
  recordNews,
  unnamedControls,
} from './browser';
import { LONG } from './long';
import { countPixels } from './pixels';

/** A picture of one pixel. */
const DOT =
  'data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==';

let app: App;

beforeAll(async () => {
  await init();
  app = await openApp();
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

const text = (selector: string) => app.page.locator(selector).first().textContent();
const hash = () => app.page.evaluate(() => location.hash);
const view = () => app.page.locator('.scene > canvas');

type Arrays = ReturnType<Mesh['arrays']>;

/** The meshes that can be shown. */
const layouts = () =>
  app.page
    .locator('[data-view=layout] option:not([hidden])')
    .evaluateAll((all) => all.map((one) => (one as HTMLOptionElement).value));

/** Returns a thin plate with a wave in it, over which no smooth base is a graph. */
function slab(): Mesh {
  const { positions, indices } = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.15 }).arrays();
  for (let at = 0; at < positions.length; at += 3) {
    const x = positions[at] ?? 0;
    positions[at + 2] = 0.06 * (positions[at + 2] ?? 0) + 0.3 * Math.sin(4 * x);
  }
  return Mesh.fromArrays(positions, indices);
}

/** A surface with few triangles, so that a page with software rendering is fast. */
const SMALL = '#sculpt?example=globe&p.edgeMin=0.09&p.edgeMax=0.2';

/**
 * Runs in the page, before anything else: keeps WebGL pictures readable at any time, not only in the frame in which
 * they are drawn.
 */
function keepPictures(): void {
  const getContext = HTMLCanvasElement.prototype.getContext as (kind: string, options?: object) => unknown;
  HTMLCanvasElement.prototype.getContext = function (this: HTMLCanvasElement, kind: string, options?: object) {
    return getContext.call(this, kind, { ...options, preserveDrawingBuffer: true });
  } as typeof HTMLCanvasElement.prototype.getContext;
}

/**
 * Runs in the page: moves the selected ellipsoid by keys, and returns after how many animation frames each move was
 * visible. Afterwards the model has followed all moves.
 */
async function framesUntilSeen(): Promise<number[]> {
  const canvas = document.querySelector<HTMLCanvasElement>('.scene > canvas');
  const copy = new OffscreenCanvas(320, 240).getContext('2d', { willReadFrequently: true });
  const lab = document.querySelector<HTMLElement>('[data-state]');
  if (!canvas || !copy || !lab) throw new Error('there is no view');
  /** Resolves when all callbacks of an animation frame have run. */
  const animationFrame = () => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve)));
  /** Horizontal centre of the drawn pixels, from the left. */
  const middle = () => {
    copy.clearRect(0, 0, 320, 240);
    copy.drawImage(canvas, 0, 0, 320, 240);
    const { data } = copy.getImageData(0, 0, 320, 240);
    let [sum, count] = [0, 0];
    for (let i = 3; i < data.length; i += 4) {
      sum += (data[i] ?? 0) * (((i - 3) / 4) % 320);
      count += data[i] ?? 0;
    }
    return sum / count;
  };
  const answers: number[] = [];
  const moves = 6;
  const states: (string | undefined)[] = [];
  new MutationObserver(() => states.push(lab.dataset.state)).observe(lab, { attributeFilter: ['data-state'] });
  for (let move = 0; move < moves; move++) {
    // The last move starts a run of its own, whose end can be awaited.
    do await animationFrame();
    while (move === moves - 1 && lab.dataset.state !== 'done');
    states.length = 0;
    const before = middle();
    canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowRight', bubbles: true }));
    let frames = 0;
    do {
      await animationFrame();
      frames += 1;
    } while (middle() < before + 1 && frames < 100);
    answers.push(frames);
  }
  while (!/running.*done$/.test(states.join(' '))) await animationFrame();
  return answers;
}

/** Returns a position in the view where there is a handle. */
async function findHandle(): Promise<{ x: number; y: number }> {
  const box = await view().boundingBox();
  if (!box) throw new Error('there is no view');
  for (let ring = 0; ring < 12; ring++) {
    for (let at = 0; at < 16; at++) {
      const angle = (2 * Math.PI * at) / 16;
      const x = box.x + box.width * (0.5 + 0.03 * ring * Math.cos(angle));
      const y = box.y + box.height * (0.5 + 0.03 * ring * Math.sin(angle));
      await app.page.mouse.move(x, y);
      if (await view().evaluate((canvas) => canvas.hasAttribute('data-handle'))) return { x, y };
    }
  }
  throw new Error('no handle was found');
}

describe('the built-in example', () => {
  test('plays to its end by itself: a bust of one component, closed, without self-intersections', async () => {
    await openAt('#sculpt', 'done');
    expect(await measured()).toMatchObject({ components: 1, genus: 0, closed: true, oriented: true, crossings: 0 });
    expect(await measured()).toMatchObject({ bands: 2, folded: 0 });
    expect(await app.page.title()).toBe('Vesicle: Sculpt');
    expect(await hash()).toBe('#sculpt');
  });

  test('describes the plots in words', async () => {
    const captions = await app.page.locator('.plots figcaption').allTextContents();
    expect(captions[0]).toMatch(/^After \d+ frames, one more iteration would move the membrane by /);
    expect(captions[2]).toMatch(/^Half of the frames took less than /);
  });

  test('all controls have names, and it fits a phone', async () => {
    expect(await unnamedControls(app.page)).toEqual([]);
    expect(await overflow(app.page, 360, 720)).toBeLessThanOrEqual(0);
    await app.page.setViewportSize({ width: 1280, height: 800 });
  });
});

describe('dragging', () => {
  beforeAll(async () => {
    await app.page.addInitScript(keepPictures);
    await openAt(SMALL, 'done');
  });

  test('moves a handle; the model follows each move within two frames', async () => {
    await app.page.click('[data-ellipsoid="1"]');
    const { x, y } = await findHandle();
    await app.page.mouse.move(x, y);
    await afterRun(app.page, async () => {
      await app.page.mouse.down();
      for (let i = 1; i <= 8; i++) await app.page.mouse.move(x + 4 * i, y - 3 * i);
      await app.page.mouse.up();
    });
    const { alongMs, answerFrames, closed, crossings } = await measured();
    expect(alongMs).toBeGreaterThanOrEqual(0);
    expect(answerFrames).toBeGreaterThan(0);
    expect(answerFrames).toBeLessThanOrEqual(2);
    expect({ closed, crossings }).toEqual({ closed: true, crossings: 0 });
    expect(await hash()).toContain('pose=');
    await expect.poll(() => app.page.locator('[data-transport=undo]').isEnabled()).toBe(true);
  });

  test('the displayed surface follows a move in the next animation frame', async () => {
    await view().press('1');
    await app.page.uncheck('[data-view=ellipsoids]');
    const frames = await app.page.evaluate(framesUntilSeen);
    expect(frames).toEqual([1, 1, 1, 1, 1, 1]);
    await app.page.check('[data-view=ellipsoids]');
  });

  test('undo restores the previous surface, and redo the later', async () => {
    const { volume: dragged } = await measured();
    await afterRun(app.page, () => app.page.click('[data-transport=undo]'));
    await expect.poll(async () => (await measured()).volume).not.toBe(dragged);
    const { volume: before } = await measured();
    await afterRun(app.page, () => app.page.click('[data-transport=redo]'));
    await expect.poll(async () => (await measured()).volume).toBe(dragged);
    await afterRun(app.page, () => app.page.click('[data-transport=undo]'));
    await expect.poll(async () => (await measured()).volume).toBe(before);
  });

  test('ellipsoids can be selected, moved and rotated by keys, with announcements', async () => {
    await view().press('2');
    expect(await text('.status')).toBe('Ellipsoid 2, small: selected.');
    const before = await app.page.inputValue('[aria-label="Centre, x"]');
    const news = await recordNews(app.page);
    await afterRun(app.page, () => view().press('ArrowRight'));
    const moved = /^Ellipsoid 2, small: moved, centre /;
    await expect.poll(news).toContainEqual(expect.stringMatching(moved));
    expect(await app.page.inputValue('[aria-label="Centre, x"]')).not.toBe(before);
    await view().press('t');
    await afterRun(app.page, () => view().press('ArrowLeft'));
    await expect.poll(news).toContainEqual(expect.stringMatching(/small: rotated/));
    await view().press('Escape');
    expect(await app.page.locator('.numbers').isVisible()).toBe(false);
  });

  test('numbers are accepted, or refused beside their field', async () => {
    await app.page.click('[data-ellipsoid="1"]');
    await app.page.fill('[aria-label="Semi-axis 1"]', '-1');
    await app.page.keyboard.press('Enter');
    expect(await text('.ellipsoids .field-error')).toBe('The length must be > 0.');
    await app.page.fill('[aria-label="Semi-axis 1"]', '0.95');
    await afterRun(app.page, () => app.page.keyboard.press('Enter'));
    expect(await hash()).toMatch(/pose=[^;]*,0\.95,/);
  });

  test('an added ellipsoid grows, and disappears when it is removed', async () => {
    await afterRun(app.page, () => app.page.click('[data-ellipsoid=add]'));
    expect(await app.page.locator('.chips [data-ellipsoid]').count()).toBe(3);
    await afterRun(app.page, () => app.page.click('[data-ellipsoid=remove]'));
    expect(await app.page.locator('.chips [data-ellipsoid]').count()).toBe(2);
  });
});

describe('an animation', () => {
  beforeAll(() => openAt(SMALL, 'done'));

  test('of two keyframes plays from one to the other, and a link restores it', async () => {
    await app.page.click('[data-film=add]');
    await app.page.click('[data-ellipsoid="2"]');
    await app.page.fill('[aria-label="Centre, y"]', '0.5');
    await afterRun(app.page, () => app.page.keyboard.press('Enter'));
    await app.page.click('[data-film=add]');
    await app.page.fill('.film input[type=number]', '6');
    await app.page.keyboard.press('Enter');
    await afterRun(app.page, () => app.page.click('.play'));
    await expect.poll(() => text('.film output')).toBe('6 of 6');
    const address = await hash();
    expect(address.match(/key=/g)).toHaveLength(2);
    await openAt(address, 'done');
    expect(await app.page.locator('[data-key]').count()).toBe(2);
    expect(await text('.film output')).toBe('6 of 6');
  });

  test('is recorded as an animated GLB', async () => {
    const [download] = await Promise.all([app.page.waitForEvent('download'), app.page.click('[data-film=record]')]);
    const bytes = await readFile(await download.path());
    expect(bytes.toString('latin1', 0, 4)).toBe('glTF');
    const json = JSON.parse(bytes.toString('utf8', 20, 20 + bytes.readUInt32LE(12)));
    expect(json.animations).toHaveLength(1);
    expect(json.meshes.length).toBeGreaterThanOrEqual(5);
    expect(json.images).toHaveLength(1);
  });
});

describe('the view', LONG, () => {
  test('shows all five meshes with their names, and distortion with its legend', async () => {
    await openAt(`${SMALL}&layout=row&color=area+distortion`, 'done');
    await expect.poll(() => app.page.locator('.captions span').count()).toBe(5);
    await expect.poll(() => app.page.locator('.color-legend:visible').isVisible()).toBe(true);
    expect(await hash()).toContain('layout=row');
  });

  test('shows the stages of a figure, and the result', async () => {
    await openAt('#sculpt?example=figure-6&p.edgeMin=0.1&p.edgeMax=0.25', 'done');
    await expect.poll(() => app.page.locator('.captions span').count()).toBe(5);
    expect(await text('.figure')).toContain('Paper:');
  });

  test('the texture has seas and lands', async () => {
    await openAt(SMALL, 'done');
    await app.page.uncheck('[data-view=ellipsoids]');
    const png = await view().screenshot();
    expect(await countPixels(app.page, png, (r, _g, b) => b > r + 50)).toBeGreaterThan(1000);
    expect(await countPixels(app.page, png, (_r, g, b) => g > b + 25)).toBeGreaterThan(1000);
  });
});

describe('a finished run', LONG, () => {
  test('shows its measures together with its state, however slowly the page draws', async () => {
    const page = await anotherPage(app, () => {
      const request = window.requestAnimationFrame.bind(window);
      window.requestAnimationFrame = (callback) => window.setTimeout(() => request(callback), 200);
    });
    await page.goto(app.address + SMALL);
    await reach(page, 'running');
    const closed = page.evaluate(
      () =>
        new Promise((resolve) => {
          const lab = document.querySelector<HTMLElement>('[data-state]');
          const table = document.querySelector<HTMLElement>('[data-measures]');
          if (!lab || !table) throw new Error('there is no lab');
          new MutationObserver(() =>
            resolve({ state: lab.dataset.state, ...JSON.parse(table.dataset.measures ?? '') }),
          ).observe(lab, { attributeFilter: ['data-state'] });
        }),
    );
    expect(await closed).toMatchObject({ state: 'done', closed: true, crossings: 0 });
    await page.close();
  });
});

describe('an example', LONG, () => {
  test('opened while the previous one is about to play never runs that one', async () => {
    const page = await anotherPage(app, () => {
      const { prototype } = Worker;
      const { postMessage, addEventListener } = prototype;
      const sent: string[] = [];
      let film = 0;
      let held: (() => void) | undefined;
      prototype.postMessage = function (this: Worker, ...given: unknown[]) {
        const { id, kind } = given[0] as { id: number; kind: string };
        sent.push(kind);
        if (kind === 'film') film ||= id;
        Reflect.apply(postMessage, this, given);
      };
      // The reply to the first request about a film is late, so that the lab waits with a scene that does not play yet.
      prototype.addEventListener = function (this: Worker, type: string, listener: (event: MessageEvent) => void) {
        const listen = (event: MessageEvent) => {
          if (type !== 'message' || held || !film || event.data.id !== film) listener(event);
          else held = () => listener(event);
        };
        Reflect.apply(addEventListener, this, [type, listen]);
      } as typeof addEventListener;
      Object.assign(window, { sent, release: () => held?.(), isHeld: () => held !== undefined });
    });
    await page.goto(`${app.address}#sculpt?example=lava`);
    await expect.poll(() => page.evaluate('isHeld()')).toBe(true);
    await page.selectOption('.data select', 'globe');
    // By then the data of the globe are ready, since they are computed.
    for (let i = 0; i < 20; i++) await page.evaluate(() => new Promise(requestAnimationFrame));
    await page.evaluate('release()');
    await expect.poll(() => page.evaluate(() => location.hash)).toBe('#sculpt?example=globe');
    await reach(page, 'done');
    const sent = await page.evaluate<string[]>('sent');
    const runs = ['open', 'play', 'settle'];
    expect(sent.filter((kind) => runs.includes(kind))).toEqual(['open', 'play', 'open', 'settle']);
    await page.locator('canvas[tabindex]').first().press('r');
    await expect.poll(() => page.textContent('.iteration')).toBe('Iteration 0');
    await reach(page, 'paused');
    await page.close();
  });
});

describe('a file', () => {
  test('rests as it is until an ellipsoid moves, and returns', async () => {
    const mesh = slab();
    await drop(app.page, [{ name: 'slab.ply', bytes: mesh.toBytes('ply') }]);
    await expect.poll(() => text('.facts dd')).toBe('slab.ply');
    await reach(app.page, 'done');
    const { volume, area } = mesh.info();
    const atRest = await measured();
    expect(atRest).toMatchObject({ components: 1, closed: true, crossings: 0, triangles: mesh.triangleCount });
    for (const [found, given] of [
      [atRest.volume, volume],
      [atRest.area, area],
    ])
      expect(Number(found) / Number(given)).toBeCloseTo(1, 6);
    expect(await hash()).toBe('#sculpt?file=slab.ply&support=surface');
    // Controls without effect are not shown.
    await app.page.evaluate(() =>
      document.querySelectorAll('details').forEach((one) => {
        one.open = true;
      }),
    );
    expect(await app.page.isVisible('[data-param=edgeMax]')).toBe(true);
    expect(await app.page.isVisible('[data-param=levels]')).toBe(false);
    expect(await layouts()).toEqual(['result']);
    await view().press('1');
    await view().press('ArrowUp');
    await expect.poll(async () => (await measured()).volume).not.toBe(atRest.volume);
    await reach(app.page, 'done');
    expect(await hash()).toMatch(/support=surface&rest=.*&pose=/);
    await view().press('Control+z');
    await expect.poll(async () => (await measured()).volume).toBe(atRest.volume);
    mesh.free();
  });

  test('stays as it is where no base can be made for a membrane', LONG, async () => {
    const before = await measured();
    await app.page.selectOption('[data-support]', 'membrane');
    await app.page.waitForSelector('[data-state=error]');
    expect(await app.page.inputValue('[data-support]')).toBe('surface');
    await app.page.click('.banner button');
    expect((await measured()).volume).toBe(before.volume);
    expect(await hash()).toContain('support=surface');
  });

  test('can be on a membrane, as in the paper', async () => {
    const mesh = Mesh.icosphere({ center: [3, 0, 0], radius: 2, maxEdge: 0.5 });
    await drop(app.page, [{ name: 'ball.ply', bytes: mesh.toBytes('ply') }]);
    mesh.free();
    await expect.poll(() => text('.facts dd')).toBe('ball.ply');
    await reach(app.page, 'done');
    const before = await measured();
    await app.page.selectOption('[data-support]', 'membrane');
    await expect.poll(hash).toBe('#sculpt?file=ball.ply&support=membrane');
    await reach(app.page, 'paused');
    expect(await app.page.isVisible('[data-param=levels]')).toBe(true);
    expect((await layouts()).length).toBeGreaterThan(3);
    await app.page.selectOption('[data-support]', 'surface');
    await expect.poll(hash).toBe('#sculpt?file=ball.ply&support=surface');
    await reach(app.page, 'paused');
    await view().press('s');
    await expect.poll(async () => (await measured()).volume).toBe(before.volume);
    await openAt(SMALL, 'done');
    expect(await app.page.isVisible('[data-support]')).toBe(false);
  });

  test('that intersects itself opens with a warning', async () => {
    const [one, other] = [0, 1.5].map((x) =>
      Mesh.icosphere({ center: [x, 0, 0], radius: 1, maxEdge: 0.3 }).arrays(),
    ) as [Arrays, Arrays];
    const more = other.indices.map((v) => v + one.positions.length / 3);
    const both = Mesh.fromArrays(
      Float32Array.from([...one.positions, ...other.positions]),
      Uint32Array.from([...one.indices, ...more]),
    );
    await drop(app.page, [{ name: 'two.ply', bytes: both.toBytes('ply') }]);
    await expect.poll(() => text('.facts dd')).toBe('two.ply');
    await reach(app.page, 'done');
    expect(await measured()).toMatchObject({ components: 2, triangles: both.triangleCount });
    expect(await text('.warnings')).toContain('intersects itself as given');
    both.free();
  });

  test('that takes long can be cancelled, and the previous data are restored', LONG, async () => {
    const bytes = new Uint8Array(await readFile(at('www/public/data/nefertiti.ply')));
    await openAt(SMALL, 'done');
    await app.page.evaluate(() => {
      location.hash = '#sculpt?file=bust.ply&support=membrane';
    });
    await drop(app.page, [{ name: 'bust.ply', bytes }]);
    await expect.poll(() => text('.status')).toMatch(/^Computing the base of bust\.ply/);
    await app.page.click('[data-action=cancel]');
    await reach(app.page, 'done');
    expect(await text('.facts dd')).toMatch(/^Globe/);
    expect(await measured()).toMatchObject({ components: 1, closed: true });
  });

  test('that is compressed with Draco opens with its texture', async () => {
    const materials = [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }];
    const bytes = dracoGlb([dracoStream(ball(0.15))], { materials, textures: [{ source: 0 }], images: [{ uri: DOT }] });
    await openAt(SMALL, 'done');
    await drop(app.page, [{ name: 'ball.glb', bytes }]);
    await expect.poll(() => text('.facts dd')).toMatch(/^ball\.glb/);
    await reach(app.page, 'done');
    expect(await measured()).toMatchObject({ components: 1, closed: true });
    expect(await app.page.isEnabled('[data-view=color] option[value=texture]')).toBe(true);
  });

  test('that is open is refused with a message, and the previous data are kept', async () => {
    const before = await text('.facts dd');
    const open = Mesh.fromArrays(Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0), Uint32Array.of(0, 1, 2));
    await drop(app.page, [{ name: 'open.ply', bytes: open.toBytes('ply') }]);
    await app.page.waitForSelector('[data-state=error]');
    expect(await text('.banner')).toMatch(/open\.ply could not be opened\..*not a closed surface/);
    await app.page.click('.banner button');
    expect(await app.page.getAttribute('#lab', 'data-state')).toBe('done');
    expect(await text('.facts dd')).toBe(before);
    open.free();
  });
});
