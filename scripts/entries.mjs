// Builds the entry points with a part of the library, `vesicle/deformable` and so on, from the package's compiled
// TypeScript: one file with the code, and copies of the declarations.

import { mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { dirname, join } from 'node:path';
import { at } from './shell.mjs';

/** The methods, each of which has an entry point. */
export const METHODS = ['deformable', 'implicit', 'tracking', 'multires'];

/** The entry points with a part of the library, each with a module of its own: a method, or the readers of files. */
export const PARTS = [...METHODS, 'import'];

/**
 * Members of classes that entry points with one method lack, and the methods that have them all the same. The documentation
 * of each says so.
 */
export const LACKING = {
  Mesh: {
    parse: [],
    decimateWithin: [],
    smooth: [],
    transform: [],
    cut: [],
    keepComponents: [],
    removeCavities: [],
    contains: [],
    toVolume: [],
    inSlices: [],
  },
  Volume: {
    parse: [],
    fromFrames: ['tracking'],
    toBytes: [],
    enrichSlices: ['tracking'],
    inSlices: ['tracking'],
    labels: [],
    label: [],
    threshold: [],
    dice: [],
    crop: [],
    resample: [],
    frame: [],
    write: [],
  },
  DeformableModel: { refresh: [] },
};

/** Removes the members of classes that the entry point of a method lacks, from code or declarations; `ts` is TypeScript. */
function without(method, name, text, ts) {
  const file = ts.createSourceFile(name, text, ts.ScriptTarget.Latest);
  const lacks = ({ name: one }, member) => {
    const methods = LACKING[one?.text]?.[member.name?.text];
    return methods !== undefined && !methods.includes(method);
  };
  const classes = file.statements.filter(ts.isClassDeclaration);
  const removed = classes.flatMap((one) => one.members.filter((member) => lacks(one, member)));
  return removed.reduceRight((rest, { pos, end }) => rest.slice(0, pos) + rest.slice(end), text);
}

/**
 * Returns a plugin that takes the glue and the location of the module from the entry point's own files, and the classes
 * of errors from `vesicle`, so that `instanceof` holds. `glue` is the path of the glue without its ending.
 */
const own = (part, glue, ts) => ({
  name: 'own',
  setup(bundle) {
    bundle.onResolve({ filter: /\/error\.js$/ }, () => ({ path: '../error.js', external: true }));
    bundle.onResolve({ filter: /\/module\.js$/ }, () => ({ path: at('pkg/entries/module.js') }));
    bundle.onResolve({ filter: /\/(vesicle|files)\.js$/ }, () => ({ path: `${glue}.js` }));
    bundle.onLoad({ filter: /\/(deformable|mesh|volume)\.js$/ }, async ({ path }) => ({
      contents: without(part, path, await readFile(path, 'utf8'), ts),
    }));
  },
});

/** Copies `file` and the declarations that it imports to the folder of the entry point; only those of errors are shared. */
async function copyDeclarations(file, part, glue, ts, done = new Set()) {
  if (done.has(file)) return;
  done.add(file);
  const isGlue = /^(vesicle|files)\.d\.ts$/.test(file);
  const text = await readFile(isGlue ? join(dirname(glue), file) : at('pkg', file), 'utf8');
  const name = file.startsWith('entries/') ? 'index.d.ts' : file;
  const local = text.replaceAll(/'\.\.?\/([\w-]+)\.js'/g, (_, one) => `'${one === 'error' ? '../' : './'}${one}.js'`);
  await writeFile(at('pkg', part, name), without(part, name, local, ts));
  for (const [, one] of text.matchAll(/'\.\.?\/([\w-]+)\.js'/g)) {
    if (one !== 'error') await copyDeclarations(`${one}.d.ts`, part, glue, ts, done);
  }
}

async function makeEntry(part, glue) {
  // Imported here because set-up installs them: on a fresh machine there are none when this file is read.
  const [{ build }, { default: ts }] = await Promise.all([import('esbuild'), import('typescript')]);
  await mkdir(at('pkg', part), { recursive: true });
  await build({
    entryPoints: [at('pkg/entries', `${part}.js`)],
    outfile: at('pkg', part, 'index.js'),
    ...{ bundle: true, format: 'esm', target: 'es2022', plugins: [own(part, glue, ts)], logLevel: 'warning' },
  });
  // A class has private members, so that its copy is another type: its objects belong to another module.
  await copyDeclarations(`entries/${part}.d.ts`, part, glue, ts);
}

/** Writes `pkg/<part>` for all parts; needs the compiled TypeScript. `glueOf` returns the path of a part's glue, without its ending. */
export async function makeEntries(glueOf) {
  for (const part of PARTS) await makeEntry(part, glueOf(part));
  await rm(at('pkg/entries'), { recursive: true });
}
