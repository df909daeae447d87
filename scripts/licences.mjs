// Lists the third-party crates and packages in the app and in the package, with their licences. Fails if one is not
// permissive, and writes the notices that are shipped with both.
import { mkdir, readdir, readFile, writeFile } from 'node:fs/promises';
import { basename, dirname, join } from 'node:path';
import { at, must, run, say, script, startedAs } from './shell.mjs';

const WASM = ['--locked', '--filter-platform', 'wasm32-unknown-unknown'];
const LISTS = 'target/licences';

/** Returns the folder of the npm package that contains a bundled file; undefined for the project's own files. */
const packageOf = (file) => file.match(/^(.*[\\/]node_modules[\\/](?:@[^\\/]+[\\/])?[^\\/]+)[\\/]/)?.[1];

/**
 * Returns Vite plugins that record the packages in a bundle called `name`: one for the page, and one for its workers,
 * which are bundles of their own. `besides` are packages whose files are copied next to it.
 */
export function noteBundled(name, besides = []) {
  const folders = new Set(besides.map((one) => at('node_modules', one)));
  const take = (bundle) => {
    const files = Object.values(bundle).flatMap(({ moduleIds = [] }) => moduleIds);
    for (const file of files) folders.add(packageOf(file.split('?')[0]) ?? '');
  };
  const generateBundle = (_, bundle) => take(bundle);
  const write = async () => {
    await mkdir(at(LISTS), { recursive: true });
    await writeFile(at(LISTS, `${name}.json`), JSON.stringify([...folders].filter(Boolean).sort()));
  };
  return {
    page: { name: 'note-bundled', generateBundle, writeBundle: write },
    worker: { name: 'note-bundled-in-worker', generateBundle },
  };
}

async function bundled(name) {
  const file = at(LISTS, `${name}.json`);
  const folders = await readFile(file, 'utf8').catch(() => {
    throw new Error(`${file} is missing: \`npm start\` or \`npm run build\` makes it`);
  });
  return JSON.parse(folders);
}

/** Returns the npm packages in the given bundles. */
export async function packagesIn(...bundles) {
  const folders = new Set((await Promise.all(bundles.map(bundled))).flat());
  return Promise.all([...folders].map(packageAt));
}

async function packageAt(folder) {
  const { name, version, license, homepage } = JSON.parse(await readFile(join(folder, 'package.json'), 'utf8'));
  return { name, version, licence: license, home: homepage, texts: await textsIn(folder, license) };
}

/** Returns the crates that are compiled into the module; procedural macros are not in it. */
export async function crates() {
  const tree = ['tree', '--locked', '--package', 'vesicle-bindings', '--edges', 'normal,no-proc-macro'];
  const shown = ['--target', 'wasm32-unknown-unknown', '--prefix', 'none', '--format', '{p}'];
  const listed = new Set((await output('cargo', [...tree, ...shown])).match(/^\S+ v\S+/gm));
  const { packages } = JSON.parse(await output('cargo', ['metadata', '--format-version', '1', ...WASM]));
  const inside = packages.filter(({ name, version, source }) => source && listed.has(`${name} v${version}`));
  return Promise.all(inside.map(crateOf));
}

async function crateOf({ name, version, license, repository, manifest_path }) {
  // Old crates separate alternatives by a slash.
  const licence = license?.replaceAll('/', ' OR ');
  return { name, version, licence, home: repository, texts: await textsIn(dirname(manifest_path), licence) };
}

/** Returns the output of a command without status messages. */
async function output(command, args) {
  const printed = await must(command, [...args, '--quiet']);
  return printed.slice(printed.search(/^[{\w]/m));
}

const IS_LICENCE = /^(licen[cs]e|copying|copyright|unlicense|notice)([-._].*)?$/i;

/** Returns the licence texts in a folder: if MIT may be chosen, only that one and notices; otherwise all. */
async function textsIn(folder, licence = '') {
  const files = (await readdir(folder)).filter((file) => IS_LICENCE.test(file) && !/\.(html|js|json)$/.test(file));
  const choice = /\bMIT\b/.test(licence) && !/\bAND\b/.test(licence);
  const short = files.filter((file) => choice && /mit|^notice/i.test(file));
  const texts = await Promise.all((short.length > 0 ? short : files).sort().map((file) => textOf(join(folder, file))));
  return texts.length > 0 ? texts : inReadme(folder);
}

const textOf = async (file) => (await readFile(file, 'utf8')).replaceAll('\r\n', '\n').trim();

/** Returns the licence at the end of a README, if there is one. */
async function inReadme(folder) {
  const text = await textOf(join(folder, 'README.md')).catch(() => '');
  const [found] = text.match(/^#*\s*licen[cs]e\b[\s\S]*\bcopyright\b[\s\S]*/im) ?? [];
  return found ? [found] : [];
}

/** Returns the permissive licences, for crates and packages alike. */
export async function allowed() {
  const [, list = ''] = (await readFile(at('deny.toml'), 'utf8')).match(/^allow = \[([^\]]*)\]/m) ?? [];
  return [...list.matchAll(/"([^"]+)"/g)].map(([, licence]) => licence);
}

/** Throws if a part cannot be used under one of the permissive licences. */
export async function refuseOthers(parts) {
  const { default: satisfies } = await import('spdx-satisfies');
  const list = await allowed();
  const permissive = ({ licence }) => {
    try {
      return satisfies(licence, list);
    } catch {
      return false;
    }
  };
  const others = parts.filter((part) => !permissive(part));
  if (others.length === 0) return;
  const named = others.map(({ name, version, licence }) => `${name} ${version} (${licence ?? 'none is named'})`);
  throw new Error(`not under a permissive licence: ${named.join(', ')}; those that are stand in deny.toml`);
}

const HEAD = `Vesicle is licensed under MIT or Apache-2.0, as you choose. In it is work of other people, under licences of their own, which follow.
The Rust standard library is in the WebAssembly module, too: MIT or Apache-2.0, the Rust project, https://github.com/rust-lang/rust.
`;

const byName = (a, b) => (a.name < b.name ? -1 : a.name > b.name ? 1 : a.version < b.version ? -1 : 1);
const title = ({ name, version, licence, home }) => `${name} ${version} (${licence})${home ? `, ${home}` : ''}`;

const MISSING = 'These come without the text of their licence; https://spdx.org/licenses has it.';

/** Formats the notices. Parts with the same text share it; a part without a text takes that of another version. */
function notices(parts) {
  const groups = new Map();
  for (const part of parts.toSorted(byName)) {
    const known = parts.find(({ name, texts }) => name === part.name && texts.length > 0);
    const text = (part.texts.length > 0 ? part : known)?.texts.join('\n\n') ?? MISSING;
    groups.set(text, [...(groups.get(text) ?? []), title(part)]);
  }
  const rule = '─'.repeat(100);
  return [...groups].map(([text, titles]) => `${rule}\n${titles.join('\n')}\n\n${text}\n`).join('\n');
}

/** Writes the notices of the given bundles and of the module to a file. */
export async function writeNotices(file, ...bundles) {
  const parts = [...(await crates()), ...(await packagesIn(...bundles))];
  await refuseOthers(parts);
  await writeFile(at(file), `${HEAD}\n${notices(parts)}`);
  return parts;
}

/** Checks everything that is used to compile and test as well, if cargo-deny is installed. */
async function askCargoDeny() {
  const { code } = await run('cargo', ['deny', '--version'], { echo: false });
  if (code !== 0) return say('cargo deny', 'not asked: `cargo install cargo-deny --locked` brings it');
  await must('cargo', ['deny', 'check', 'licenses', 'bans', 'sources']);
  say('cargo deny', 'licences, bans and sources are as deny.toml has them');
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    for (const [file, ...bundles] of [
      ['pkg/licences.txt', 'element'],
      ['dist/licences.txt', 'element', 'app'],
    ]) {
      const parts = await writeNotices(file, ...bundles);
      say(basename(dirname(at(file))), `${parts.length} crates and packages, all permissive: ${file}`);
    }
    await askCargoDeny();
  });
}
