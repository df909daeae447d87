import { existsSync } from 'node:fs';
import type { Browser, Page } from 'playwright-core';
import { buildApp } from '../../scripts/app.mjs';
import { launchChromium } from '../../scripts/chromium.mjs';
import { serve } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';

/** Milliseconds until something on the page is given up. */
const PATIENCE = 120_000;

export interface App {
  page: Page;
  address: string;
  /** What should never happen: console errors, uncaught errors, requests to anywhere but the page's own address. */
  complaints: string[];
  close: () => Promise<void>;
}

/** The labs, with the address of an example that each is soon done with. */
export const QUICK = {
  extract: 'extract?example=linked-rings',
  reconstruct: 'reconstruct?example=two-balls',
  track: 'track?example=ventricle',
  sculpt: 'sculpt?example=globe',
};
export const LABS = Object.keys(QUICK) as (keyof typeof QUICK)[];

/** The built app in a browser of its own, at an address within the app. */
export async function openApp(viewport = { width: 1280, height: 800 }, address = ''): Promise<App> {
  if (!existsSync(at('dist/index.html'))) await buildApp();
  const server = await serve(at('dist'), 0);
  const browser = await launchChromium();
  const context = await browser.newContext({ viewport });
  // A machine that draws in software, and is busy, is slow, not wrong.
  context.setDefaultTimeout(PATIENCE);
  const complaints: string[] = [];
  // Tabs that the page opens are listened to like the page.
  context.on('page', (one) => listen(one, server.address, complaints));
  const page = await context.newPage();
  await page.goto(server.address + address);
  return { page, address: server.address, complaints, close: () => closeAll(browser, server) };
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

/** A page beside that of the app, for which `prepare` runs before its own scripts; its complaints go to the same list. */
export async function anotherPage({ page }: App, prepare = () => {}): Promise<Page> {
  const another = await page.context().newPage();
  await another.addInitScript(prepare);
  return another;
}

/** The page anew, at an address such as `track`. */
export async function open({ page, address }: Pick<App, 'page' | 'address'>, hash: string): Promise<void> {
  await page.goto('about:blank');
  await page.goto(`${address}#${hash}`);
}

/** Unfolds all that can be. */
export function unfold(page: Page): Promise<void> {
  return page.locator('details').evaluateAll((all) => {
    for (const one of all) (one as HTMLDetailsElement).open = true;
  });
}

/** Waits until the lab is in one of the states; an error that is not among them fails with its message. */
export async function reach(page: Page, ...states: string[]): Promise<string> {
  const selector = [...new Set([...states, 'error'])].map((state) => `[data-state=${state}]`).join(', ');
  const lab = await page.waitForSelector(selector, { timeout: 2 * PATIENCE });
  const state = (await lab.getAttribute('data-state')) ?? '';
  // It may have gone on since.
  if (state === 'error' && !states.includes(state))
    throw new Error(`the lab is in error: ${await page.textContent('.banner')}`);
  return state;
}

/** Writes down every state the lab goes through from now on; returns how to read the list. */
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

/** Writes down everything the status line says from now on: the next news may come before anybody has read it. */
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

/** Drops files on the page, as from the desktop. */
export async function drop(page: Page, files: { name: string; bytes: Uint8Array }[]): Promise<void> {
  const encoded = files.map(({ name, bytes }) => ({ name, base64: Buffer.from(bytes).toString('base64') }));
  await page.evaluate((list) => {
    const transfer = new DataTransfer();
    for (const { name, base64 } of list) {
      const bytes = Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
      transfer.items.add(new File([bytes], name));
    }
    for (const type of ['dragover', 'drop']) {
      window.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }
  }, encoded);
}

/** How much wider than a window of this size the page is. */
export async function overflow(page: Page, width: number, height: number): Promise<number> {
  await page.setViewportSize({ width, height });
  return page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
}

/** The controls that a screen reader has no name for. */
export function unnamedControls(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const controls = document.querySelectorAll<HTMLInputElement>('input, select, button, canvas, progress');
    const named = (control: HTMLInputElement) =>
      control.getAttribute('aria-label') || control.textContent?.trim() || control.labels?.[0]?.textContent?.trim();
    const hidden = (control: Element) => control.closest('[aria-hidden=true], [hidden]') !== null;
    return [...controls].filter((one) => !hidden(one) && !named(one)).map((one) => one.outerHTML);
  });
}

/** Presses Cancel, in the page, the moment it can be: a fast machine is done before a click from outside arrives. */
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
