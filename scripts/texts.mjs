// Writes the placeholders of the app's texts as types, so that the compiler finds values that are missing.
import { readFile, writeFile } from 'node:fs/promises';
import { at, say, script, startedAs } from './shell.mjs';

const CATALOGUE = at('www/src/texts/en.json');
const TYPES = at('www/src/texts/placeholders.ts');

/** Returns the source of the types for a catalogue. */
export function typesOf(catalogue) {
  const lines = Object.entries(catalogue).flatMap(([section, texts]) =>
    Object.entries(texts).flatMap(([name, text]) => {
      const names = [...new Set([...text.matchAll(/\{(\w+)\}/g)].map(([, placeholder]) => `'${placeholder}'`))];
      return names.length > 0 ? [`  '${section}.${name}': ${names.join(' | ')};`] : [];
    }),
  );
  return `/** The placeholders of each text that has any. Written by \`npm run texts\`. */
export interface Placeholders {
${lines.join('\n')}
}
`;
}

async function main() {
  await writeFile(TYPES, typesOf(JSON.parse(await readFile(CATALOGUE, 'utf8'))));
  say('texts', TYPES);
}

if (startedAs(import.meta.url)) await script(main);
