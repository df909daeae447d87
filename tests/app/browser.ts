import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import type { Browser, BrowserContextOptions, Page } from 'playwright-core';
import { expect } from 'vitest';
import { launchChromium } from '../../scripts/chromium.mjs';
import { serveApp } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import type { LabId } from '../../www/src/lab/address';

/** Timeout in milliseconds for anything on the page. */
const PATIENCE = 120_000;

export interface App {
  page: Page;
  address: string;
  /** Console errors, uncaught errors, and requests to other origins than the page's own; tests expect none. */
  complaints: string[];
  close: () => Promise<void>;
}

/** The labs, each with the address of a fast example. */
export const QUICK: Record<LabId, string> = {
  extract: 'extract?example=linked-rings',
  reconstruct: 'reconstruct?example=two-balls',
  track: 'track?example=ventricle',
  sculpt: 'sculpt?example=globe',
  segment: 'segment?example=ovule',
};
export const LABS = Object.keys(QUICK) as LabId[];
/** The labs whose model runs: their pages have Play and Step. */
export const RUNNING: readonly LabId[] = LABS.filter((lab) => lab !== 'segment');

/**
 * Launches a browser, which the caller closes. It composes pages without WebGL: with WebGL in software, composing the
 * page would take longer than drawing the surface. Nothing that is drawn is smoothed along its edges.
 */
export const launch = () => launchChromium('--disable-gpu-compositing', '--webgl-antialiasing-mode=none');

/** Opens an empty page, which adds its errors, of the console and uncaught, to `complaints`. */
export async function openPage(browser: Browser, complaints: string[], options?: BrowserContextOptions): Promise<Page> {
  const page = await browser.newPage(options);
  page.on('console', (message) => message.type() === 'error' && complaints.push(message.text()));
  page.on('pageerror', (error) => complaints.push(error.message));
  return page;
}

/** Writes a page with a content security policy as `index.html` of a folder. */
export async function writePage(folder: string, policy: string, body: string, head = ''): Promise<void> {
  const start = `<meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="${policy}">`;
  const all = `${start}<link rel="icon" href="data:,">${head}`;
  const text = `<!doctype html><html lang="en"><head>${all}</head><body>${body}</body></html>`;
  await writeFile(join(folder, 'index.html'), text);
}

/**
 * Opens the built app in a browser of its own, at an address within the app, with few pixels: drawing in software takes
 * most of the time otherwise. Tests of what is drawn ask for as many as `viewport` has.
 */
export async function openApp(
  viewport = { width: 1280, height: 800 },
  address = '',
  deviceScaleFactor = 0.5,
): Promise<App> {
  const server = await serveApp(at('dist'), 0);
  const browser = await launch();
  const context = await browser.newContext({ viewport, deviceScaleFactor });
  await context.addInitScript(agree);
  // A busy machine with software rendering is slow, not wrong.
  context.setDefaultTimeout(PATIENCE);
  const complaints: string[] = [];
  // Tabs that the page opens are observed as well.
  context.on('page', (one) => listen(one, server.address, complaints));
  const page = await context.newPage();
  await page.goto(server.address + address);
  return { page, address: server.address, complaints, close: () => closeAll(browser, server) };
}

/**
 * Agrees at once to lose what is not saved, unless a test sets `data-asked` at the page's root, and does not have the browser
 * keep it.
 */
function agree(): void {
  // Blank pages have no storage.
  if (location.protocol === 'http:') localStorage.setItem('vesicle.keep', 'no');
  const answer = () => {
    if (document.documentElement.dataset.asked === undefined)
      document.querySelector<HTMLElement>('dialog.question[open] button[value=go]')?.click();
  };
  new MutationObserver(answer).observe(document, { childList: true, subtree: true, attributes: true });
}

async function closeAll(browser: Browser, server: { close: () => unknown }): Promise<void> {
  await browser.close();
  await server.close();
}

function listen(page: Page, address: string, complaints: string[]): void {
  page.on('console', (message) => {
    if (message.type() === 'error') complaints.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => complaints.push(`uncaught: ${error.message}`));
  page.on('request', (request) => {
    const url = request.url();
    if (new URL(url).origin !== new URL(address).origin && !/^(blob|data):/.test(url))
      complaints.push(`foreign: ${url}`);
  });
}

/**
 * Opens another page of the app, in which `prepare` runs before its own scripts; its complaints are added to the same
 * list.
 */
export async function anotherPage({ page }: App, prepare = () => {}): Promise<Page> {
  const another = await page.context().newPage();
  await another.addInitScript(prepare);
  return another;
}

/** Reloads the page at an address such as `track`. */
export async function open({ page, address }: Pick<App, 'page' | 'address'>, hash: string): Promise<void> {
  await page.goto('about:blank');
  await page.goto(`${address}#${hash}`);
}

/** Expands all collapsible parts. */
export async function unfold(page: Page): Promise<void> {
  await page.locator('details').evaluateAll((all) => {
    for (const one of all) (one as HTMLDetailsElement).open = true;
  });
  // Panels that begin to work when they are unfolded are told in a later task.
  await page.evaluate(() => new Promise((told) => requestAnimationFrame(() => setTimeout(told))));
  await page.waitForFunction(() => !document.querySelector('[aria-busy=true]'));
}

/** Waits until the lab is in one of the states; an unexpected error fails with its message. */
export async function reach(page: Page, ...states: string[]): Promise<string> {
  const selector = [...new Set([...states, 'error'])].map((state) => `[data-state=${state}]`).join(', ');
  const lab = await page.waitForSelector(selector, { timeout: 2 * PATIENCE });
  const state = (await lab.getAttribute('data-state')) ?? '';
  // The state may have changed since.
  if (state === 'error' && !states.includes(state))
    throw new Error(`the lab is in error: ${await page.textContent('.banner')}`);
  return state;
}

/** Records every state of the lab from now on; returns a function that reads the list. */
export async function recordStates(page: Page): Promise<() => Promise<string[]>> {
  const list = await page.evaluateHandle(() => {
    const states: string[] = [];
    const lab = document.querySelector<HTMLElement>('[data-state]');
    const note = () => states.push(lab?.dataset.state ?? '');
    if (lab) new MutationObserver(note).observe(lab, { attributeFilter: ['data-state'] });
    return states;
  });
  return () => list.jsonValue();
}

/** Makes a change that starts a run, and waits until that run, or the last of several, has converged. */
export async function afterRun<Result>(page: Page, change: () => Promise<Result>): Promise<Result> {
  const states = await recordStates(page);
  const result = await change();
  await expect.poll(async () => (await states()).join(' ')).toMatch(/\brunning\b.* done$/);
  return result;
}

/** Records every text of the status line from now on, since the next may replace it before a test reads it. */
export async function recordNews(page: Page): Promise<() => Promise<string[]>> {
  const list = await page.evaluateHandle(() => {
    const news: string[] = [];
    const line = document.querySelector('.status');
    const note = () => news.push(line?.textContent ?? '');
    if (line) new MutationObserver(note).observe(line, { childList: true, characterData: true, subtree: true });
    return news;
  });
  return () => list.jsonValue();
}

export interface Measures {
  vertices: number;
  triangles: number;
  components: number;
  chi: number;
  genus: number;
  volume: number;
  area: number;
  closed: boolean;
  oriented: boolean;
  crossings: number;
}

export async function measures(page: Page): Promise<Measures> {
  return JSON.parse((await page.getAttribute('[data-measures]', 'data-measures')) ?? '{}');
}

export async function iteration(page: Page): Promise<number> {
  return Number((await page.textContent('.iteration'))?.replace(/\D/g, ''));
}

/** Drops files on the page, as from the desktop; on the element that `target` selects, if given. */
export async function drop(page: Page, files: { name: string; bytes: Uint8Array }[], target = ''): Promise<void> {
  const encoded = files.map(({ name, bytes }) => ({ name, base64: Buffer.from(bytes).toString('base64') }));
  await page.evaluate(
    ([list, target]) => {
      const transfer = new DataTransfer();
      for (const { name, base64 } of list) {
        const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
        transfer.items.add(new File([bytes], name));
      }
      for (const type of ['dragover', 'drop']) {
        const event = new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true });
        (target ? document.querySelector(target) : window)?.dispatchEvent(event);
      }
    },
    [encoded, target] as const,
  );
}

/** Returns by how many pixels the page is wider than a window of this size. */
export async function overflow(page: Page, width: number, height: number): Promise<number> {
  await page.setViewportSize({ width, height });
  return page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
}

/** Returns the controls without an accessible name. */
export function unnamedControls(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const controls = document.querySelectorAll<HTMLInputElement>('input, select, button, canvas, progress');
    const named = (control: HTMLInputElement) =>
      control.getAttribute('aria-label') || control.textContent?.trim() || control.labels?.[0]?.textContent?.trim();
    const hidden = (control: Element) => control.closest('[aria-hidden=true], [hidden]') !== null;
    return [...controls].filter((one) => !hidden(one) && !named(one)).map((one) => one.outerHTML);
  });
}

/** Presses Cancel as soon as it is enabled, from inside the page: a click from outside may arrive after the end. */
export async function cancelAtOnce(page: Page): Promise<void> {
  await page.evaluate(() => {
    const cancel = document.querySelector<HTMLButtonElement>('[data-action=cancel]');
    const press = () => {
      if (!cancel || cancel.hidden) return;
      watch.disconnect();
      cancel.click();
    };
    const watch = new MutationObserver(press);
    if (cancel) watch.observe(cancel, { attributeFilter: ['hidden'] });
  });
}
