import { build } from 'vite';
import { expect, test } from 'vitest';
import { at } from '../../scripts/shell.mjs';
import { open, reach } from './browser';
import { deploy } from './deployment';

test('a new deployment is used at the next visit, and files of the old one are deleted', async () => {
  const app = await deploy();
  try {
    await open(app, 'extract?example=linked-rings&v=2');
    await reach(app.page, 'done');
    const old = await app.listed();
    await expect.poll(app.kept).toEqual(expect.arrayContaining(old));
    await app.stopServer();
    const mark = "\ndocument.documentElement.dataset.deployment = 'second';";
    await build({
      configFile: at('www/vite.config.ts'),
      logLevel: 'error',
      build: { outDir: app.folder, emptyOutDir: true },
      plugins: [
        { name: 'another', transform: (code, id) => (id.endsWith('www/src/app/main.ts') ? code + mark : undefined) },
      ],
    });
    const fresh = await app.listed();
    await app.restartServer();
    await open(app, 'sculpt?example=globe');
    await reach(app.page, 'done');
    expect(await app.page.getAttribute('html', 'data-deployment')).toBe('second');
    expect(old.filter((name) => !fresh.includes(name)).length).toBeGreaterThan(0);
    await expect.poll(async () => (await app.kept()).filter((name) => name.startsWith('assets/'))).toEqual(fresh);
    expect(app.uncaught).toEqual([]);
  } finally {
    await app.close();
  }
});
