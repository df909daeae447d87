// Builds `<vesicle-lab>`: one file with its code and three.js, and its types. It imports the library from the same
// folder.
import { bundle } from './bundle.mjs';
import { noteBundled } from './licences.mjs';
import { at, must, tool } from './shell.mjs';

/** Files that the element shares with the package are not bundled. */
const shared = {
  name: 'shared',
  enforce: 'pre',
  resolveId: (id) =>
    id.startsWith('../') && id.endsWith('.js') ? { id: `./${id.slice(3)}`, external: true } : undefined,
};

/** Writes `pkg/element.js` and its types; needs the rest of the package. */
export async function makeElement() {
  await bundle('element', 'js/element/index.ts', [shared, noteBundled('element').page], true);
  await must(tool('tsc'), ['-p', at('js/element')]);
}
