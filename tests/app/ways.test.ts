/**
 * The same settings, reached in many ways in random order, give the same surface, to the bit: entered before or during a
 * run, after other values, by undo and redo, from a session, from a link, after a reload and a reset, over other
 * examples, and by copied code in Node.
 */
import { readFile } from 'node:fs/promises';
import type { Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import type { NamedBytes, RunCode } from '../../www/src/engine/protocol';
import { uniform } from '../../www/src/engine/random';
import { computedCloud } from '../../www/src/labs/reconstruct/clouds';
import { cineVoxels } from '../../www/src/labs/track/cine';
import { type App, drop, openApp, reach, unfold } from './browser';
import { LONG } from './long';
import { pickFrom, programsIn } from './run-code';

const RUNS = process.env.PROPERTY_RUNS;
/** Seeds of the random walks in each lab; the message of a failure has the seed and the ways that were taken. */
const SEEDS = Array.from({ length: Number(RUNS ?? 1) }, (_, index) => index + 1);
/** Ways of a walk: all of them, or for every change a few in each lab. */
const WAYS = RUNS === undefined ? 3 : 10;

await init();

type Random = () => number;
/** Values of parameters as they are typed, chosen or, as true and false, ticked. */
type Values = Record<string, string | boolean>;

/** Data of a lab, and settings for them. */
interface Case {
  lab: 'extract' | 'reconstruct' | 'track' | 'sculpt';
  /** The example that is open, or else the user's file. */
  example?: string;
  file?: () => Promise<NamedBytes>;
  /** Another example, which is opened in between. */
  other: string;
  /** Settings to reach, and others to change in between. */
  right: (random: Random) => Values;
  wrong: (random: Random) => Values;
  /** Makes the settings that are no parameters, when the right ones are in force for all others. */
  arrange?: (page: Page) => Promise<void>;
  /** Whether only what was in force from the first step on counts: the surface moves on from where it is. */
  movesOn?: boolean;
  /** How far a link's rounding moves vertices at most. */
  linked?: number;
}

/** A number with all its digits. */
const between = (random: Random, low: number, high: number) => String(low + (high - low) * random());

async function smallTooth(): Promise<NamedBytes> {
  const volume = Volume.parse(new Uint8Array(await readFile(at('www/public/data/tooth.nrrd'))));
  return { name: 'tooth.nrrd', bytes: volume.pyramid(4).at(-1)?.toBytes('nrrd') ?? new Uint8Array() };
}

async function fewPoints(): Promise<NamedBytes> {
  const { points } = computedCloud('two balls');
  const lines = Array.from({ length: points.length / 9 }, (_, i) => points.subarray(9 * i, 9 * i + 3).join(' '));
  return { name: 'balls.xyz', bytes: new TextEncoder().encode(`${lines.join('\n')}\n`) };
}

/** A sequence whose lengths are in metres. */
async function smallCine(): Promise<NamedBytes> {
  const spacing = [0.0021, 0.0021, 0.0023] as [number, number, number];
  const voxels = cineVoxels({
    dims: [24, 24, 24],
    spacing: [2, 2, 2],
    frames: 3,
    noise: 4,
    size: 18,
    papillary: false,
  });
  const volume = new Volume({ data: voxels, dims: [24, 24, 24, 3], spacing, origin: [0.0123456, -0.04, 0.1] });
  return { name: 'metres.nii', bytes: volume.toNifti() };
}

const ball = async (): Promise<NamedBytes> => ({
  name: 'ball.ply',
  bytes: Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 }).toBytes('ply'),
});

const CASES: Record<string, Case> = {
  'Extract, an example': {
    lab: 'extract',
    example: 'linked-rings',
    other: 'sponge',
    right: (random) => ({ iso: between(random, 110, 140), rigidity: between(random, 0.05, 0.2), stiffness: '0.2' }),
    wrong: (random) => ({ iso: between(random, 60, 200), adaptivity: '0.5', integrator: 'euler' }),
    movesOn: true,
  },
  'Extract, a file': {
    lab: 'extract',
    file: smallTooth,
    other: 'linked-rings',
    // Defaults of the method, which the first example has not.
    right: (random) => ({ iso: between(random, 590, 620), rigidity: '0.2', isoForce: '-1' }),
    wrong: (random) => ({ iso: between(random, 300, 900), rigidity: between(random, 0, 1), isoForce: '-2.5' }),
    movesOn: true,
  },
  'Reconstruct, an example': {
    lab: 'reconstruct',
    example: 'two-balls',
    other: 'torus',
    right: (random) => ({
      lambdaSurface: between(random, 0.001, 0.1),
      cell: between(random, 0.06, 0.08),
      maxPoints: '900',
    }),
    // With more than the right ones, 900 points have no surface.
    wrong: (random) => ({ lambdaSurface: between(random, 0.0001, 0.001), tau: '0.05', maxPoints: '' }),
  },
  'Reconstruct, a file': {
    lab: 'reconstruct',
    file: fewPoints,
    other: 'two-balls',
    right: (random) => ({ lambdaSurface: between(random, 0.001, 0.1), cell: between(random, 0.06, 0.08) }),
    wrong: (random) => ({ lambdaSurface: between(random, 0.1, 1), level: 'mean' }),
  },
  'Track, an example': {
    lab: 'track',
    example: 'ventricle',
    other: 'thick-slices',
    right: (random) => ({ threshold: between(random, 40, 70), damping: between(random, 0.7, 1), windowFrames: '1' }),
    wrong: (random) => ({ threshold: between(random, 20, 90), prediction: false, windowFrames: '0' }),
  },
  'Track, a file': {
    lab: 'track',
    file: smallCine,
    other: 'ventricle',
    right: (random) => ({ threshold: between(random, 40, 60), damping: between(random, 0.7, 1) }),
    wrong: (random) => ({ threshold: between(random, 20, 90), prediction: false }),
    arrange: (page) => region(page, '0-first', 2),
  },
  'Sculpt, an example': {
    lab: 'sculpt',
    example: 'globe',
    other: 'figure-10',
    // The link must have the other length, too, which the model would choose to suit.
    right: (random) => ({ edgeMax: '0.4', smoothing: '20', distribute: pickFrom(random)(['1', '2']) }),
    wrong: (random) => ({ distribute: '5', smoothing: '30', edgeMax: between(random, 0.5, 0.6) }),
    arrange: (page) => moved(page, '0.15'),
    movesOn: true,
  },
  'Sculpt, a file': {
    lab: 'sculpt',
    file: ball,
    other: 'globe',
    right: () => ({}),
    wrong: () => ({ edgeMax: '0.7' }),
    // Less than where an ellipsoid stops, which depends on the way there.
    arrange: (page) => moved(page, '0.03'),
    movesOn: true,
    linked: 1e-3,
  },
};

/** Sets the first or last voxel of the region that is tracked. */
async function region(page: Page, end: string, voxel: number): Promise<void> {
  await page.fill(`[data-box="${end}"]`, String(voxel));
  await page.press(`[data-box="${end}"]`, 'Enter');
  await quiet(page);
}

/** Moves the first ellipsoid along x. */
async function moved(page: Page, x: string): Promise<void> {
  const button = page.locator('[data-ellipsoid="1"]');
  // A click on the selected one would deselect it.
  if ((await button.getAttribute('aria-pressed')) === 'false') await button.click();
  await page.locator('.numbers input').first().fill(x);
  await page.locator('.numbers input').first().press('Enter');
  await quiet(page);
}

let app: App;

beforeAll(async () => {
  app = await openApp();
  await app.page.context().addInitScript(countRequests);
  await app.page.emulateMedia({ reducedMotion: 'reduce' });
  // Asks before work is lost by a reload.
  app.page.on('dialog', (dialog) => void dialog.accept());
});
afterAll(async () => {
  expect(app.complaints).toEqual([]);
  await app.close();
});

/** Runs in the page, before anything else: counts the requests that workers have not answered. */
function countRequests(): void {
  const all = new Set<{ isBusy: boolean }>();
  const isBusy = () => [...all].some((one) => one.isBusy);
  class Counted extends Worker {
    readonly #open = new Set<unknown>();
    #pose = 0;
    constructor(url: string | URL, options?: WorkerOptions) {
      super(url, options);
      all.add(this);
      this.addEventListener('message', ({ data }) => {
        this.#open.delete(data?.id);
        // A frame answers all poses up to its own.
        if (data?.poseId >= this.#pose) this.#pose = 0;
      });
    }
    get isBusy() {
      return this.#open.size > 0 || this.#pose > 0;
    }
    // biome-ignore lint/suspicious/noExplicitAny: as in the class that it extends
    override postMessage(message: any, options?: any): void {
      if (message.id !== undefined) this.#open.add(message.id);
      if (message.kind === 'pose') this.#pose = message.poseId;
      super.postMessage(message, options);
    }
    override terminate(): void {
      all.delete(this);
      super.terminate();
    }
  }
  Object.assign(globalThis, { Worker: Counted, isBusy });
}

/** Waits until nothing is under way: all requests are answered, and the lab runs and opens nothing. Fails on an error. */
async function quiet(page: Page, isFine = true): Promise<void> {
  await page.waitForFunction(() => {
    const state = document.querySelector<HTMLElement>('#lab')?.dataset.state ?? '';
    const isBusy = (globalThis as unknown as { isBusy: () => boolean }).isBusy();
    return !isBusy && ['done', 'paused', 'error'].includes(state);
  });
  const errors = isFine ? await page.locator('.banner:not([hidden]) [data-error]').allTextContents() : [];
  expect(errors.join(), await hashOf(page)).toBe('');
}

/** Sets a parameter. */
async function set(page: Page, name: string, value: string | boolean): Promise<void> {
  const field = page.locator(`[data-param=${name}]`);
  if (typeof value === 'boolean') await field.locator('input[type=checkbox]').first().setChecked(value);
  else if ((await field.locator('select').count()) > 0) await field.locator('select').selectOption(value);
  else {
    await field.locator('input[type=number]').fill(value);
    await field.locator('input[type=number]').press('Enter');
  }
}

/** The present value of a parameter. */
async function get(page: Page, name: string): Promise<string | boolean> {
  const control = page
    .locator(`[data-param=${name}]`)
    .locator('select, input[type=number], input[type=checkbox]')
    .first();
  return control.evaluate((one: HTMLInputElement) => (one.type === 'checkbox' ? one.checked : one.value));
}

/** Clicks what saves a file, and returns its content. */
async function saved(page: Page, selector: string): Promise<Uint8Array> {
  const download = page.waitForEvent('download');
  await page.click(selector);
  return new Uint8Array(await readFile(await (await download).path()));
}

/** Returns the surface; in Track, that of the last frame. */
async function surface(page: Page): Promise<Uint8Array> {
  const frames = page.locator('.frames input[type=range]');
  if ((await frames.count()) > 0) await frames.fill((await frames.getAttribute('max')) ?? '');
  return saved(page, '[data-export=ply]');
}
const dataOf = (page: Page) => saved(page, '[data-action=data]');
const press = (page: Page, name: string) => page.locator('.transport').getByRole('button', { name }).click();

/** Two surfaces: the same bits, or vertices that are no further apart than the link has rounded the ellipsoids. */
function expectSame(found: Uint8Array, expected: Uint8Array, tolerance: number, what: string): void {
  if (tolerance === 0) {
    expect(Buffer.compare(found, expected), what).toBe(0);
    return;
  }
  const [one, other] = [found, expected].map((bytes) => Mesh.parse(bytes).arrays()) as [Arrays, Arrays];
  expect(one.indices, what).toEqual(other.indices);
  const off = one.positions.map((x, i) => Math.abs(x - (other.positions[i] ?? 0)));
  expect(Math.max(...off), what).toBeLessThan(tolerance);
}

type Arrays = ReturnType<Mesh['arrays']>;

/** A random walk over the settings of one lab, which returns to the right ones. */
class Walk {
  readonly page: Page;
  readonly #case: Case;
  readonly #random: Random;
  /** Right values of all parameters that the walk changes. */
  #right: Values;
  #last = '';
  /** Whether a link was followed, which may have rounded the settings. */
  #isLinked = false;
  #file: NamedBytes | undefined;

  constructor(page: Page, one: Case, random: Random) {
    this.page = page;
    this.#case = one;
    this.#random = random;
    this.#right = one.right(random);
  }

  get file(): NamedBytes | undefined {
    return this.#file;
  }

  /** Opens the data, and sets the right values. */
  async begin(): Promise<void> {
    this.#file = await this.#case.file?.();
    await this.#goto(`${this.#case.lab}?example=${this.#case.example ?? this.#case.other}&v=2`);
    if (this.#file) await this.#drop();
    const others = Object.keys(this.#case.wrong(this.#random));
    for (const name of others) this.#right[name] ??= await get(this.page, name);
    await this.#reach();
  }

  async #goto(hash: string): Promise<void> {
    await this.page.goto('about:blank');
    await this.page.goto(`${app.address}#${hash}`);
    await reach(this.page, 'done', 'paused', 'running');
    // A link to a file asks for it.
    await quiet(this.page, !hash.includes('file='));
    await unfold(this.page);
  }

  /** Drops the user's file, and has all of it tracked if the lab asks what. */
  async #drop(): Promise<void> {
    const { page } = this;
    const [file, asks] = [this.#file as NamedBytes, page.locator('[data-object=whole]')];
    await drop(page, [{ ...file, bytes: file.bytes.slice() }]);
    await page.waitForFunction((name) => document.querySelector('.facts')?.textContent?.includes(name), file.name);
    await quiet(page, false);
    if (await asks.isVisible()) await asks.click();
    await quiet(page);
  }

  /** Sets the right values, and runs to the end. */
  async #reach(): Promise<void> {
    for (const [name, value] of Object.entries(this.#right)) {
      await set(this.page, name, value);
      await quiet(this.page);
      this.#last = name;
    }
    if (this.#case.movesOn) await this.#reset();
    await this.#case.arrange?.(this.page);
    await this.#finish();
  }

  async #reset(): Promise<void> {
    await press(this.page, 'Reset');
    await quiet(this.page);
  }

  async #finish(): Promise<void> {
    // At once, as the lab may go on by itself between a look and a click.
    await this.page.evaluate(() => {
      const isPaused = document.querySelector('#lab')?.getAttribute('data-state') === 'paused';
      if (isPaused) document.querySelector<HTMLButtonElement>('.transport .play:enabled')?.click();
    });
    await quiet(this.page);
  }

  /** Sets other values of some parameters; returns of how many. */
  async #stray(waits = true): Promise<number> {
    // Values of the same parameter that are set in quick succession are undone together.
    const all = Object.entries(this.#case.wrong(this.#random)).filter(([name]) => name !== this.#last);
    const some = all.filter((_, index) => index === 0 || this.#random() < 0.6);
    for (const [name, value] of some) {
      await set(this.page, name, value);
      if (waits) await quiet(this.page);
    }
    return some.length;
  }

  async #travel(way: 'undo' | 'redo', steps: number): Promise<number> {
    const button = this.page.locator(`[data-transport=${way}]:enabled`);
    for (let step = 0; step < steps; step++) {
      if ((await button.count()) === 0) return step;
      await button.click();
      await quiet(this.page);
    }
    return steps;
  }

  async #restart(work: () => Promise<unknown>): Promise<void> {
    await this.#reset();
    await work();
    await this.#reach();
  }

  async #link(follow: () => Promise<unknown>): Promise<void> {
    await follow();
    this.#isLinked = true;
    await reach(this.page, 'done', 'paused', 'running');
    await quiet(this.page, false);
    if (this.#file) await this.#drop();
    await unfold(this.page);
  }

  /** The ways from the right settings over others back to them. */
  readonly ways: Record<string, () => Promise<void>> = {
    'other values after a run': async () => {
      await this.#stray();
      await this.#reach();
    },
    'other values before a run': () => this.#restart(() => this.#stray()),
    'other values during a run': () =>
      this.#restart(async () => {
        await this.page.locator('.transport .play').click();
        await this.#stray(false);
      }),
    undo: async () => {
      const steps = await this.#stray();
      await this.#travel('undo', steps);
    },
    redo: async () => {
      const steps = await this.#travel('undo', 1 + Math.floor(3 * this.#random()));
      await this.#travel('redo', steps);
    },
    session: async () => {
      const { page } = this;
      if (this.#file) await page.check('[data-session=included]');
      const bytes = await saved(page, '[data-action=session]');
      await this.#another();
      await drop(page, [{ name: 'a.vesicle.zip', bytes }]);
      const name = this.#file?.name ?? this.#case.example ?? '';
      await page.waitForFunction((name) => location.hash.includes(name), name);
      await quiet(page);
    },
    'a link': () => this.#link(async () => this.#goto((await hashOf(this.page)).slice(1))),
    'a reload': () => this.#link(() => this.page.reload()),
    'another example': async () => {
      await this.#another();
      if (this.#file) await this.#drop();
      else await this.#choose(this.#case.example ?? '');
      await this.#reach();
    },
    reset: async () => {
      await this.#reset();
      await this.#case.arrange?.(this.page);
      await this.#finish();
    },
  };

  /** How far vertices may be from those at the beginning. */
  get tolerance(): number {
    return this.#isLinked ? (this.#case.linked ?? 0) : 0;
  }

  async #choose(example: string): Promise<void> {
    await this.page.selectOption('.data select', example);
    await this.page.waitForFunction((name) => location.hash.includes(name), example);
    await quiet(this.page);
  }

  #another(): Promise<void> {
    return this.#choose(this.#case.other);
  }
}

const hashOf = (page: Page) => page.evaluate(() => location.hash);

/** Returns the code of the present run. */
async function codeOf(page: Page): Promise<RunCode> {
  await page.evaluate(() => Object.assign(navigator.clipboard, { writeText: () => Promise.reject() }));
  const bytes = await saved(page, '[data-action=code]');
  return { code: new TextDecoder().decode(bytes) } as RunCode;
}

/** Returns a surface without its texture coordinates. */
function shapeOf(surface: Uint8Array): Uint8Array {
  const { positions, indices } = Mesh.parse(surface).arrays();
  return Mesh.fromArrays(positions, indices).toBytes('ply');
}

/** A list in random order. */
function shuffled<T>(list: T[], random: Random): T[] {
  const keyed = list.map((one) => [random(), one] as const);
  return keyed.sort(([one], [other]) => one - other).map(([, one]) => one);
}

const programs = await programsIn('ways');

/** Those that run for every change; the others are long. */
const QUICK = ['Extract, a file', 'Sculpt, an example'];

for (const [name, one] of Object.entries(CASES))
  describe(name, QUICK.includes(name) ? {} : LONG, () => {
    test.each(SEEDS)('all ways lead to one surface, with seed %i', async (seed) => {
      const random = uniform(100 * seed + Object.keys(CASES).indexOf(name));
      const walk = new Walk(app.page, one, random);
      await walk.begin();
      const [expected, hash] = [await surface(app.page), await hashOf(app.page)];
      const path: string[] = [];
      for (const [way, go] of shuffled(Object.entries(walk.ways), random).slice(0, WAYS)) {
        path.push(way);
        await go();
        const what = `seed ${seed}: ${path.join(', ')}`;
        expect(await hashOf(app.page), what).toBe(hash);
        expectSame(await surface(app.page), expected, walk.tolerance, what);
      }
      const last = await surface(app.page);
      await programs.add(seed, await codeOf(app.page));
      const given = walk.file ?? { name: 'data', bytes: new Uint8Array(await dataOf(app.page)) };
      // The code has no map on the globe, whose texture coordinates it rounds otherwise.
      await programs.expectSame([last], [given], one.example === 'globe' ? shapeOf : undefined);
    });
  });
