// The browser side of the notebook widget, with a fake notebook: traits, and events when they change.
import { cp, mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import type { Browser, Page } from 'playwright-core';
import init, { Mesh } from 'vesicle';
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import type { Traits } from '../../examples/notebook/surface';
import { makeNotebook, WIDGET } from '../../scripts/notebook.mjs';
import { serve } from '../../scripts/serve.mjs';
import { launch, openPage, writePage } from './browser';
import { countPixels } from './pixels';

/** A notebook's restrictions on widgets: no files beside it, no network. */
const POLICY =
  "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' blob:; connect-src 'self'; img-src data: blob:";

/** Runs in the page: loads the widget from a blob address, as anywidget does, with a fake model. */
const SCRIPT = `
  const text = await (await fetch('./surface.js')).text();
  const address = URL.createObjectURL(new Blob([text], { type: 'text/javascript' }));
  const { default: widget } = await import(address);

  class Model {
    traits = {}; sent = {}; unsaved = new Set(); listeners = [];
    get(name) { return this.traits[name]; }
    set(name, value) {
      if (this.traits[name] === value) return;
      this.traits[name] = value;
      this.unsaved.add(name);
      for (const [event, listener] of this.listeners) if (event === 'change:' + name) listener();
    }
    save_changes() { for (const name of this.unsaved) this.sent[name] = this.traits[name]; this.unsaved.clear(); }
    on(event, listener) { this.listeners.push([event, listener]); }
    off() { this.listeners = []; }
  }

  // Bytes of a message may begin anywhere in its buffer.
  const packed = (kind, shape, bytes) => {
    const buffer = new Uint8Array(bytes.length + 3);
    buffer.set(bytes, 3);
    return { kind, shape, data: new DataView(buffer.buffer, 3) };
  };

  window.rings = () => {
    const shape = [49, 33, 33];
    const bytes = new Uint8Array(49 * 33 * 33);
    for (let i = 0; i < bytes.length; i++) {
      const [x, y, z] = [(i % 49) - 24, (Math.floor(i / 49) % 33) - 16, Math.floor(i / (49 * 33)) - 16];
      const flat = Math.hypot(Math.hypot(x + 6, y) - 11, z);
      const upright = Math.hypot(Math.hypot(x - 6, z) - 11, y);
      bytes[i] = Math.max(0, Math.min(100, 50 + 50 * (3.5 - Math.min(flat, upright))));
    }
    return packed('uint8', shape, bytes);
  };

  const AFFINE = [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 10, 20, 30, 1];
  window.open = async (given) => {
    const model = new Model();
    Object.assign(model.traits, { volume: rings(), affine: AFFINE, levels: 1, params: { iso: 50 }, running: true, state: 'loading', message: '' }, given);
    const made = await widget();
    await made.initialize({ model });
    const views = await Promise.all([1, 2].map(() => {
      const el = document.body.appendChild(document.createElement('div'));
      return made.render({ model, el });
    }));
    Object.assign(window, { model, views });
  };
  document.title = 'ready';`;

let browser: Browser;
let folder = '';
let server: { address: string; close: () => unknown };
let page: Page;
const complaints: string[] = [];

beforeAll(async () => {
  await Promise.all([init(), makeNotebook()]);
  folder = await mkdtemp(join(tmpdir(), 'vesicle-notebook-'));
  await cp(WIDGET, join(folder, 'surface.js'));
  await writePage(folder, POLICY, `<script type="module">${SCRIPT}</script>`);
  server = await serve(folder, 0);
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await server.close();
  await rm(folder, { recursive: true, force: true });
});

beforeEach(async () => {
  page = await openPage(browser, complaints);
  await page.goto(server.address);
  await expect.poll(async () => complaints[0] ?? (await page.title())).toBe('ready');
});
afterEach(async () => {
  await page.close();
  expect(complaints.splice(0)).toEqual([]);
});

/** Opens a widget with these traits in two cells of the page. */
const open = (given: string) => page.evaluate(`open(${given})`);

/** Returns the value of a trait as sent to Python. */
const told = <Name extends keyof Traits>(name: Name) => page.evaluate(`model.sent.${name}`) as Promise<Traits[Name]>;

/** Sets a trait as Python would. */
const tell = (name: keyof Traits, value: string) => page.evaluate(`model.set('${name}', ${value})`);

const reach = (state: Traits['state']) =>
  expect.poll(async () => complaints[0] ?? [await told('state'), await told('message')].join(' ').trim()).toBe(state);

/** Returns the mesh as Python receives it. */
async function mesh(): Promise<Mesh> {
  const [positions, indices] = await Promise.all(
    ['vertices', 'triangles'].map((name) =>
      page.evaluate(
        `(({ data }) => [...new ${name === 'vertices' ? 'Float32Array' : 'Uint32Array'}(data.buffer)])(model.sent.${name})`,
      ),
    ),
  );
  return Mesh.fromArrays(Float32Array.from(positions as number[]), Uint32Array.from(indices as number[]));
}

test('a volume gives the surface of its two rings, displayed in both cells', async () => {
  await open('{}');
  await reach('done');
  const rings = await mesh();
  const { components, genus, volume, bounds } = rings.info();
  expect({ components, genus }).toEqual({ components: 2, genus: 2 });
  expect(rings.check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
  // Voxels are 2 wide, and the first lies at 10, 20, 30: two tori around (46, 52, 62) and (70, 52, 62).
  expect(volume / (8 * 2 * 2 * Math.PI ** 2 * 11 * 3.5 ** 2)).toBeCloseTo(1, 1);
  expect(bounds.min[0]).toBeCloseTo(10 + 2 * 3.5, -0.5);
  expect((await told('vertices'))?.shape).toEqual([rings.vertexCount, 3]);
  expect((await told('triangles'))?.shape).toEqual([rings.triangleCount, 3]);
  for (const canvas of await page.locator('canvas').all()) {
    const light = await countPixels(page, await canvas.screenshot(), (r) => r > 90);
    expect(light).toBeGreaterThan(2000);
  }
  expect(await page.locator('output').allTextContents()).toEqual(
    Array(2).fill(`Step ${await told('iteration')}, ${rings.vertexCount} vertices`),
  );
});

test('it pauses, continues, and continues with changed parameters', async () => {
  await open('{ running: false }');
  await reach('paused');
  expect(await told('iteration')).toBe(0);
  expect((await mesh()).check()).toMatchObject({ closed: true, selfIntersections: 0 });
  await tell('running', 'true');
  await reach('done');
  const [steps, before] = [await told('iteration'), (await mesh()).info().volume];
  await tell('params', '{ iso: 90 }');
  await expect.poll(() => told('iteration')).toBeGreaterThan(steps);
  await reach('done');
  expect((await mesh()).info().volume).toBeLessThan(before);
});

test('invalid parameters are reported and change nothing; an invalid volume is an error, and the next one works', async () => {
  await open('{}');
  await reach('done');
  const steps = await told('iteration');
  await tell('params', '{ isoo: 3 }');
  await expect.poll(() => told('message')).toMatch(/isoo/);
  expect(await page.locator('output').allTextContents()).toEqual(Array(2).fill(await told('message')));
  expect([await told('state'), await told('iteration')]).toEqual(['done', steps]);
  await tell('params', '{ iso: 50 }');
  await expect.poll(() => told('message')).toBe('');
  await tell('volume', "{ ...rings(), kind: 'complex64' }");
  await expect.poll(() => told('state')).toBe('error');
  expect(await told('message')).toMatch(/complex64; there are uint8/);
  await tell('volume', 'rings()');
  await reach('done');
  expect((await mesh()).info().components).toBe(2);
});

test('a removed view is no longer updated', async () => {
  await open('{ running: false }');
  await reach('paused');
  await page.evaluate('views[0]()');
  await tell('running', 'true');
  await reach('done');
  const [left, kept] = await page.locator('output').allTextContents();
  expect([left, kept]).toEqual([expect.stringMatching(/^Step 0/), expect.stringMatching(/^Step [1-9]/)]);
});
