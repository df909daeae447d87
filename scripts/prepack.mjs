// Refuses to pack a package that is not whole: npm runs this in the package's folder before it packs.
import { access, readdir, readFile } from 'node:fs/promises';
import { dirname, join, normalize } from 'node:path';

/** A file that code loads at run time, beside itself. */
const LOADED = /new URL\((['"])(\.[^'"]+)\1,\s*import\.meta\.url\)/g;

const isThere = (path) =>
  access(path).then(
    () => true,
    () => false,
  );

/** Returns the paths of the files that the package's code and its entry points name. */
async function namedFiles() {
  const { exports } = JSON.parse(await readFile('package.json', 'utf8'));
  const named = Object.values(exports).flatMap((target) =>
    typeof target === 'string' ? [target] : Object.values(target),
  );
  for (const path of await readdir('.', { recursive: true })) {
    if (!path.endsWith('.js')) continue;
    const code = await readFile(path, 'utf8');
    named.push(...Array.from(code.matchAll(LOADED), ([, , file]) => join(dirname(path), file)));
  }
  return [...new Set(named.map(normalize))];
}

/** Returns what is wrong with the package in the present folder, as text. */
async function problems() {
  const files = await namedFiles();
  const found = [];
  for (const file of files) if (!(await isThere(file))) found.push(`${file} is missing`);
  if (found.length > 0) return found;
  const modules = files.filter((file) => file.endsWith('vesicle_bg.wasm'));
  const sizes = await Promise.all(modules.map(async (file) => (await readFile(file)).length));
  // As `npm start` makes it, in a quarter of the time.
  return new Set(sizes).size < sizes.length ? ['one module stands in for those of the entry points'] : [];
}

const wrong = await problems();
if (wrong.length > 0) {
  console.error(`This package is not whole: ${wrong.join(', ')}. Make it by \`npm run build\`.`);
  process.exitCode = 1;
}
