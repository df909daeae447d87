// Builds the entry points with a part of the library, `vesicle/deformable` and so on, from the package's compiled
// TypeScript: one file with the code, and copies of the declarations.

import { mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { at } from './shell.mjs';

/** The methods, each of which has an entry point. */
export const METHODS = ['deformable', 'implicit', 'tracking', 'multires'];

/** The entry points with a part of the library, each with a module of its own: a method, or the readers of files. */
export const PARTS = [...METHODS, 'import'];

/** Sentence in the documentation of what entry points with one method lack; the methods that have it all the same. */
const LACKING = /Entry points with one method lack it(?:, but for `vesicle\/(\w+)`)?/;

/** A documented member of a class, in code or declarations: up to the line that ends it, which has its indentation. */
const MEMBER = /\n {4}\/\*\*(?:(?!\*\/)[\s\S])*\*\/\n {4}(?:\S.*;|\S[\s\S]*?\n {4}\}(?:.*;)?)(?=\n)/g;

/** Removes the members of classes that the entry point of a method lacks, from code or declarations. */
const without = (method, text) =>
  text.replaceAll(MEMBER, (member) => {
    const [lacking, has] = LACKING.exec(member) ?? [];
    return lacking && has !== method ? '' : member;
  });

/**
 * Returns a plugin that takes the glue and the location of the module from the entry point's own files, and the classes
 * of errors from `vesicle`, so that `instanceof` holds. `glue` is the path of the glue without its ending.
 */
const own = (part, glue) => ({
  name: 'own',
  setup(bundle) {
    bundle.onResolve({ filter: /\/error\.js$/ }, () => ({ path: '../error.js', external: true }));
    bundle.onResolve({ filter: /\/module\.js$/ }, () => ({ path: at('pkg/entries/module.js') }));
    bundle.onResolve({ filter: /\/(vesicle|files)\.js$/ }, () => ({ path: `${glue}.js` }));
    bundle.onLoad({ filter: /\/(mesh|volume)\.js$/ }, async ({ path }) => ({
      contents: without(part, await readFile(path, 'utf8')),
    }));
  },
});

/** Copies `file` and the declarations that it imports to the folder of the entry point; only those of errors are shared. */
async function copyDeclarations(file, part, glue, done = new Set()) {
  if (done.has(file)) return;
  done.add(file);
  const isGlue = /^(vesicle|files)\.d\.ts$/.test(file);
  const text = await readFile(isGlue ? join(dirname(glue), file) : at('pkg', file), 'utf8');
  const name = file.startsWith('entries/') ? 'index.d.ts' : file;
  const local = text.replaceAll(/'\.\.?\/([\w-]+)\.js'/g, (_, one) => `'${one === 'error' ? '../' : './'}${one}.js'`);
  await writeFile(at('pkg', part, name), without(part, local));
  for (const [, one] of text.matchAll(/'\.\.?\/([\w-]+)\.js'/g)) {
    if (one !== 'error') await copyDeclarations(`${one}.d.ts`, part, glue, done);
  }
}

async function makeEntry(part, glue) {
  // Imported here because set-up installs it: on a fresh machine there is no esbuild when this file is read.
  const { build } = await import('esbuild');
  await mkdir(at('pkg', part), { recursive: true });
  await build({
    entryPoints: [at('pkg/entries', `${part}.js`)],
    outfile: at('pkg', part, 'index.js'),
    ...{ bundle: true, format: 'esm', target: 'es2022', plugins: [own(part, glue)], logLevel: 'warning' },
  });
  // A class has private members, so that its copy is another type: its objects belong to another module.
  await copyDeclarations(`entries/${part}.d.ts`, part, glue);
}

/** Writes `pkg/<part>` for all parts; needs the compiled TypeScript. `glueOf` returns the path of a part's glue, without its ending. */
export async function makeEntries(glueOf) {
  for (const part of PARTS) await makeEntry(part, glueOf(part));
  await rm(at('pkg/entries'), { recursive: true });
}
