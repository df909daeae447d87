// Makes `<vesicle-lab>`: its code with three.js in one file, and its types; the library is the one beside it.
import { copyFile } from 'node:fs/promises';
import { join } from 'node:path';
import { build } from 'vite';
import { at, must, tool } from './shell.mjs';

/** What the element shares with the package stays where it is. */
const shared = {
  name: 'shared',
  enforce: 'pre',
  resolveId: (id) =>
    id.startsWith('../') && id.endsWith('.js') ? { id: `./${id.slice(3)}`, external: true } : undefined,
};

/** Writes `pkg/element.js` and its types; needs the rest of the package. */
export async function makeElement() {
  const outDir = at('target/element');
  await build({
    ...{ configFile: false, logLevel: 'warn', publicDir: false, plugins: [shared] },
    build: {
      ...{ target: 'es2022', outDir, emptyOutDir: true, minify: true },
      rolldownOptions: { output: { minify: true } },
      lib: { entry: at('js/element/index.ts'), formats: ['es'], fileName: () => 'element.js' },
    },
  });
  await copyFile(join(outDir, 'element.js'), at('pkg/element.js'));
  await must(tool('tsc'), ['-p', at('js/element')]);
}
