// Bundles several modules of the package into one file.
import { copyFile } from 'node:fs/promises';
import { at } from './shell.mjs';

/** Bundles `entry` into `pkg/<name>.js`, with additional plugins. */
export async function bundle(name, entry, plugins, minify) {
  // Imported here because set-up installs it: on a fresh machine there is no Vite when this file is read.
  const { build } = await import('vite');
  const outDir = at('target', name);
  const { NODE_ENV } = process.env;
  await build({
    ...{ configFile: false, logLevel: 'warn', publicDir: false, plugins },
    build: {
      ...{ target: 'es2022', outDir, emptyOutDir: true, minify, rolldownOptions: { output: { minify } } },
      lib: { entry: at(entry), formats: ['es'], fileName: () => `${name}.js` },
    },
  });
  // Vite sets it to `production`, also for all programs that this process starts later.
  if (NODE_ENV === undefined) delete process.env.NODE_ENV;
  await copyFile(at('target', name, `${name}.js`), at('pkg', `${name}.js`));
}
