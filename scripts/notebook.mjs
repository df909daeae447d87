// Bundles the browser side of the notebook widget into one file, the only form that a notebook accepts; needs pkg/.
import { at, say, script, startedAs } from './shell.mjs';

export const WIDGET = at('examples/notebook/built/surface.js');

/** Bundles `examples/notebook/surface.ts` with the package and three.js. */
export async function makeNotebook() {
  // Imported here because set-up installs it.
  const { build } = await import('esbuild');
  const alias = { 'vesicle/inline': at('pkg/inline.js'), 'vesicle/three': at('pkg/adapters/three.js') };
  const entry = { entryPoints: [at('examples/notebook/surface.ts')], outfile: WIDGET, alias };
  await build({ ...entry, bundle: true, minify: true, format: 'esm', target: 'es2022', logLevel: 'warning' });
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    await makeNotebook();
    say('notebook', WIDGET);
  });
}
