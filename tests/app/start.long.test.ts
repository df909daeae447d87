// docs/start.md as a newcomer follows it: its commands and files, in a folder of their own, without a network.
import { cp, mkdir, mkdtemp, readFile, rm, symlink, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { gzipSync } from 'node:zlib';
import type { Browser, Page } from 'playwright-core';
import init, { Volume } from 'vesicle';
import { build, createServer, preview } from 'vite';
import { afterAll, afterEach, beforeAll, beforeEach, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';
import { at, must } from '../../scripts/shell.mjs';
import { launch, openPage } from './browser';
import { countPixels } from './pixels';

let home = '';
/** Folder in which the commands of the page run. */
let folder = '';
let browser: Browser;
let page: Page;
const complaints: string[] = [];

beforeAll(async () => {
  home = await mkdtemp(join(tmpdir(), 'vesicle-start-'));
  folder = join(home, 'vesicle');
  await clone();
  // The blocks after that are fragments.
  const [text = ''] = (await readFile(at('docs/start.md'), 'utf8')).split('\n## Memory\n');
  // A block with the content of a file follows its name.
  for (const [, name = '', kind, body = ''] of text.matchAll(/(?:`([\w./]+)`:\n\n)?```(\w+)\n([\s\S]*?)```/g)) {
    if (kind === 'sh') await type(body);
    else if (name) await writeFile(join(folder, name), body);
    else await writeInWorker(body);
  }
  await writeFile(join(folder, 'public/volume.nii.gz'), await balls());
  await cp(join(folder, 'public/volume.nii.gz'), join(folder, 'plain/volume.nii.gz'));
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
  await rm(home, { recursive: true, force: true });
});

beforeEach(async () => {
  page = await openPage(browser, complaints, { viewport: { width: 600, height: 400 } });
  page.setDefaultTimeout(120_000);
});
afterEach(async () => {
  await page.close();
  expect(complaints.splice(0)).toEqual([]);
});

/** Copies the needed parts of the clone to a folder with the page's name for it. */
async function clone(): Promise<void> {
  await mkdir(join(home, 'vesicle'));
  for (const name of ['pkg', 'www']) await symlink(at(name), join(home, 'vesicle', name));
}

/** Runs typed commands, except servers, which the tests start, and downloads, which are replaced by links. */
async function type(block: string): Promise<void> {
  const lines = block.split('\n').filter((line) => !/^npx vite|^npm install @|^npm ci|^npm run build/.test(line));
  const env = { npm_config_offline: 'true', npm_config_audit: 'false', npm_config_fund: 'false' };
  const printed = await must('sh', ['-ec', `${lines.join('\n')}\necho "now in $PWD"`], { cwd: folder, env });
  folder = printed.match(/^now in (.*)$/m)?.[1] ?? '';
  const wanted = block.match(/^npm install (@.*)$/m)?.[1]?.split(' ') ?? [];
  for (const named of wanted) await link(named);
}

/** Writes the page's variant with a worker. */
async function writeInWorker(rest: string): Promise<void> {
  const [main, page] = await Promise.all(['main.js', 'index.html'].map((name) => readFile(join(folder, name), 'utf8')));
  const [first] = (main ?? '').replace("from 'vesicle'", "from 'vesicle/worker'").split(/(?<=await init\(\);\n)/);
  await writeFile(join(folder, 'in-worker.js'), `${first}${rest}`);
  await writeFile(join(folder, 'in-worker.html'), (page ?? '').replace('main.js', 'in-worker.js'));
}

/** Links an installed package of the version that the page names. */
async function link(named: string): Promise<void> {
  const [, name = '', version] = named.match(/^(.+)@([\d.]+)$/) ?? [];
  const here = at('node_modules', name);
  expect(JSON.parse(await readFile(join(here, 'package.json'), 'utf8'))).toMatchObject({ name, version });
  await mkdir(dirname(join(folder, 'node_modules', name)), { recursive: true });
  await symlink(here, join(folder, 'node_modules', name));
}

const RADIUS = 8;
const ENCLOSED = 2 * (4 / 3) * Math.PI * RADIUS ** 3;

/** Returns a file with a volume of two balls; the surface around both must split. */
async function balls(): Promise<Uint8Array> {
  await init();
  const [nx, ny, nz] = [48, 24, 24];
  const data = Uint8Array.from({ length: nx * ny * nz }, (_, i) => {
    const [x, y, z] = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
    const away = Math.min(...[12, 35].map((centre) => Math.hypot(x - centre, y - 11.5, z - 11.5)));
    return Math.max(0, Math.min(190, 95 + 95 * (RADIUS - away)));
  });
  return gzipSync(new Volume({ data, dims: [nx, ny, nz] }).toNifti());
}

/** Returns the number of pixels in the warm colours of the surfaces. */
async function warmPixels(): Promise<number> {
  const picture = await page.screenshot();
  // Lines drawn by NiiVue are pure red.
  return countPixels(page, picture, (r, g, b) => r > b + 30 && g > 30);
}

async function found(): Promise<void> {
  const status = page.locator('#status');
  await expect.poll(async () => complaints[0] ?? (await status.textContent())).toMatch(/^Done/);
  const [, enclosed, parts] = (await status.textContent())?.match(/^Done: (\d+) mm³.* parts: (\d+)\.$/) ?? [];
  expect(Number(enclosed) / ENCLOSED).toBeCloseTo(1, 1);
  expect(parts).toBe('2');
  await expect.poll(warmPixels).toBeGreaterThan(1000);
}

test('`npx vite`: in NiiVue, and clicking', async () => {
  const server = await createServer({
    root: folder,
    configFile: false,
    logLevel: 'error',
    server: { host: '127.0.0.1', port: 0 },
  });
  try {
    await server.listen();
    const address = server.resolvedUrls?.local[0] ?? '';
    await page.goto(address);
    await found();
    await page.mouse.click(80, 170);
    await expect
      .poll(() => page.locator('#place').textContent())
      .toMatch(/^Intensity \d+ at x = -?\d+, y = -?\d+, z = -?\d+ mm$/);
    await page.goto(`${address}in-worker.html`);
    await found();
    await page.goto(`${address}three.html`);
    await expect.poll(warmPixels).toBeGreaterThan(1000);
  } finally {
    await server.close();
  }
});

test('`npx vite build`', async () => {
  await build({ root: folder, configFile: false, logLevel: 'error' });
  const server = await serve(join(folder, 'dist'), 0);
  try {
    await page.goto(server.address);
    await found();
  } finally {
    await server.close();
  }
});

test('`npx vite preview --outDir plain`', async () => {
  const options = { build: { outDir: 'plain' }, preview: { host: '127.0.0.1', port: 0 } };
  const server = await preview({ root: folder, configFile: false, logLevel: 'error', ...options });
  try {
    await page.goto(server.resolvedUrls?.local[0] ?? '');
    await page.waitForSelector('vesicle-lab[data-state=done]');
    expect(await page.locator('vesicle-lab output').textContent()).toMatch(/in 2 components\.$/);
    await expect.poll(warmPixels).toBeGreaterThan(1000);
  } finally {
    await server.close();
  }
});
