// Makes one file of the package out of several.
import { copyFile } from 'node:fs/promises';
import { at } from './shell.mjs';

/** Bundles `entry` into `pkg/<name>.js`, with plugins of its own. */
export async function bundle(name, entry, plugins, minify) {
  // Fetched by set-up, which comes first: on a fresh machine there is no Vite when this file is read.
  const { build } = await import('vite');
  const outDir = at('target', name);
  await build({
    ...{ configFile: false, logLevel: 'warn', publicDir: false, plugins },
    build: {
      ...{ target: 'es2022', outDir, emptyOutDir: true, minify, rolldownOptions: { output: { minify } } },
      lib: { entry: at(entry), formats: ['es'], fileName: () => `${name}.js` },
    },
  });
  await copyFile(at('target', name, `${name}.js`), at('pkg', `${name}.js`));
}
