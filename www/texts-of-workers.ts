import { existsSync, readFileSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import type { Plugin } from 'vite';

type Catalogue = Record<string, Record<string, string>>;

/** Imports of other files of the app, types apart, which leave nothing behind. */
const IMPORTS = /(?:^|\n)\s*(?:import|export)\s+(?!type\b)[^'";]*?from\s+'(\.[^']+)'|import\(\s*'(\.[^']+)'\s*\)/g;
/** Strings that may be keys of texts: section and name. */
const KEYS = /['"`](\w+\.\w+)['"`]/g;
const ENDINGS = ['', '.ts', '.tsx', '/index.ts', '/index.tsx'];

/** Returns the files of the app that an entry imports, itself included. */
export function filesFrom(entry: string): Set<string> {
  const found = new Set([entry]);
  for (const file of found) {
    if (file.endsWith('.json')) continue;
    for (const [, still, later] of readFileSync(file, 'utf8').matchAll(IMPORTS)) {
      const path = resolve(dirname(file), still ?? later ?? '');
      const ending = ENDINGS.find((one) => /\.\w+$/.test(path + one) && existsSync(path + one));
      if (ending !== undefined) found.add(path + ending);
    }
  }
  return found;
}

/** Returns the strings in the files that an entry imports which may be keys of texts. */
export function keysFrom(entry: string): Set<string> {
  const sources = [...filesFrom(entry)].filter((file) => /\.tsx?$/.test(file));
  return new Set(sources.flatMap((file) => [...readFileSync(file, 'utf8').matchAll(KEYS)].map(([, key = '']) => key)));
}

/** Returns the texts of a catalogue that have one of the keys, plural forms included. */
export function textsOf(catalogue: Catalogue, keys: ReadonlySet<string>): Catalogue {
  const isNamed = (key: string) => keys.has(key) || keys.has(key.replace(/_[a-z]+$/, ''));
  const sections = Object.entries(catalogue).map(([section, texts]) => {
    const named = Object.entries(texts).filter(([name]) => isNamed(`${section}.${name}`));
    return [section, Object.fromEntries(named)] as const;
  });
  return Object.fromEntries(sections.filter(([, texts]) => Object.keys(texts).length > 0));
}

/** Leaves out of a worker the texts that its code does not name: nearly all are of the page. */
export function fewTexts(): Plugin {
  let keys: ReadonlySet<string> = new Set();
  return {
    name: 'few-texts',
    apply: 'build',
    enforce: 'pre',
    buildStart({ input }) {
      const [entry] = Object.values(input);
      if (entry) keys = keysFrom(entry);
    },
    transform: (code, id) =>
      /[\\/]src[\\/]texts[\\/]\w+\.json$/.test(id) ? JSON.stringify(textsOf(JSON.parse(code), keys)) : undefined,
  };
}
