// Builds the entry points with one method each, `vesicle/deformable` and so on, from the package's compiled TypeScript:
// one file with the code, and copies of the declarations.

import { mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { at } from './shell.mjs';

/** The methods, each of which has an entry point. */
export const METHODS = ['deformable', 'implicit', 'tracking', 'multires'];

/**
 * Returns a plugin that takes the glue and the location of the module from the entry point's own files, and the classes
 * of errors from `vesicle`, so that `instanceof` holds.
 */
const own = (glue) => ({
  name: 'own',
  setup(bundle) {
    bundle.onResolve({ filter: /\/error\.js$/ }, () => ({ path: '../error.js', external: true }));
    bundle.onResolve({ filter: /\/module\.js$/ }, () => ({ path: at('pkg/entries/module.js') }));
    bundle.onResolve({ filter: /\/vesicle\.js$/ }, () => ({ path: join(glue, 'vesicle.js') }));
  },
});

/** Copies `file` and the declarations that it imports to `folder`; only those of errors are shared. */
async function copyDeclarations(file, folder, glue, done = new Set()) {
  if (done.has(file)) return;
  done.add(file);
  const text = await readFile(file === 'vesicle.d.ts' ? join(glue, file) : at('pkg', file), 'utf8');
  const name = file.startsWith('entries/') ? 'index.d.ts' : file;
  const local = text.replaceAll(/'\.\.?\/([\w-]+)\.js'/g, (_, one) => `'${one === 'error' ? '../' : './'}${one}.js'`);
  await writeFile(at('pkg', folder, name), local);
  for (const [, one] of text.matchAll(/'\.\.?\/([\w-]+)\.js'/g)) {
    if (one !== 'error') await copyDeclarations(`${one}.d.ts`, folder, glue, done);
  }
}

async function makeEntry(method, glue) {
  // Imported here because set-up installs it: on a fresh machine there is no esbuild when this file is read.
  const { build } = await import('esbuild');
  await mkdir(at('pkg', method), { recursive: true });
  await build({
    entryPoints: [at('pkg/entries', `${method}.js`)],
    outfile: at('pkg', method, 'index.js'),
    ...{ bundle: true, format: 'esm', target: 'es2022', plugins: [own(glue)], logLevel: 'warning' },
  });
  // A class has private members, so that its copy is another type: its objects belong to another module.
  await copyDeclarations(`entries/${method}.d.ts`, method, glue);
}

/** Writes `pkg/<method>` for all methods; needs the compiled TypeScript. `glueOf` returns the folder of a method's glue. */
export async function makeEntries(glueOf) {
  for (const method of METHODS) await makeEntry(method, glueOf(method));
  await rm(at('pkg/entries'), { recursive: true });
}
