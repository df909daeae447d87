import { cp, mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect } from 'vitest';
import { serveApp } from '../../scripts/serve.mjs';
import { at } from '../../scripts/shell.mjs';
import { launch } from './browser';

/** Serves a copy of the built app, which a test may change, and opens a browser, whose service worker is observed. */
export async function deploy() {
  const folder = await mkdtemp(join(tmpdir(), 'vesicle-'));
  await cp(at('dist'), folder, { recursive: true });
  let server = await serveApp(folder, 0);
  const { address } = server;
  const browser = await launch();
  const page = await browser.newPage();
  page.setDefaultTimeout(120_000);
  const uncaught: string[] = [];
  page.on('pageerror', ({ message }) => uncaught.push(message));

  /** Returns the addresses of all cached files, without the server's. */
  async function kept(): Promise<string[]> {
    const urls = await page.evaluate(async () => {
      const lists = (await caches.keys()).map(async (name) => (await caches.open(name)).keys());
      return (await Promise.all(lists)).flat().map(({ url }) => url);
    });
    expect(urls.filter((url) => !url.startsWith(address))).toEqual([]);
    return urls.map((url) => url.slice(address.length)).sort();
  }

  return {
    ...{ folder, address, browser, page, uncaught, kept },
    /** Returns the files that the app lists as its code. */
    listed: async (): Promise<string[]> => JSON.parse(await readFile(join(folder, 'files.json'), 'utf8')),
    stopServer: () => server.close(),
    /** Serves at the same address again. */
    restartServer: async () => {
      server = await serveApp(folder, Number(new URL(address).port));
    },
    close: async () => {
      await browser.close();
      await server.close();
      await rm(folder, { recursive: true });
    },
  };
}
