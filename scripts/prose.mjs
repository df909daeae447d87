// Reports phrases that are not plain English or not the field's terms, in Markdown, comments, messages and the interface's texts.
// `npm run prose -- src/mesh docs` reads these files and folders only. docs/glossary.md says which term is used for what.
import { existsSync, statSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { relative, resolve } from 'node:path';
import { TextlintKernel } from '@textlint/kernel';
import markdown from '@textlint/textlint-plugin-markdown';
import text from '@textlint/textlint-plugin-text';
import { proseOf } from './prose/extract.mjs';
import { literalRules, ruledOut } from './prose/glossary.mjs';
import { PHRASES } from './prose/phrases.mjs';
import { phraseRule } from './prose/rule.mjs';
import { must, root, script, startedAs } from './shell.mjs';

/** Files that have prose. */
const ENDINGS = /\.(md|rs|[mc]?[jt]sx?|py|css|toml)$|^www\/src\/texts\/.*\.json$/;
/** Files that consist of examples for the rules. */
const OWN = /^(scripts\/prose\/phrases\.mjs|tests\/js\/prose\.test\.mjs)$/;

const PLUGINS = [
  { pluginId: 'markdown', plugin: markdown.default ?? markdown },
  { pluginId: 'text', plugin: text.default ?? text },
];
const kernel = new TextlintKernel();

/** Returns all rules: the glossary's and the phrases. */
export const allPhrases = async () => [...literalRules(await ruledOut()), ...PHRASES];

/** Lints the text of one file; returns `{ path, line, found, use }` for each finding, by line. */
export async function lint(path, source, phrases) {
  const found = await Promise.all(proseOf(path, source).map((document) => lintDocument(path, document, phrases)));
  return found.flat().sort((a, b) => a.line - b.line);
}

/** Lints one document of `proseOf`. */
export async function lintDocument(path, { kind, ext, text: prose }, phrases) {
  const applied = phrases.filter(({ only = kind, files }) => only === kind && (files?.test(path) ?? true));
  const options = { phrases: applied };
  const rules = [{ ruleId: 'phrases', rule: phraseRule, options }];
  const { messages } = await kernel.lintText(prose, { ext, filePath: path, plugins: PLUGINS, rules });
  return messages.map(({ loc, message }) => {
    const [found, use] = message.split('\t');
    return { path, line: loc.start.line, found, use };
  });
}

/** Returns the files that are one of `paths`, and those under git, or not yet, that are in a folder of them; all without any. */
async function filesIn(paths) {
  const given = paths.map((path) => relative(root, resolve(path)) || '.');
  const isFile = (path) => statSync(resolve(root, path)).isFile();
  const named = given.filter(isFile);
  const folders = given.filter((path) => !isFile(path));
  if (named.length > 0 && folders.length === 0) return named;
  const listed = await must('git', ['ls-files', '--cached', '--others', '--exclude-standard', '--', ...folders]);
  const found = listed.split('\n').filter((file) => ENDINGS.test(file) && !OWN.test(file));
  return [...new Set([...named, ...found])];
}

/** Lints files and folders, by default the whole repository. */
export async function lintFiles(paths = []) {
  const phrases = await allPhrases();
  const files = (await filesIn(paths)).filter((file) => existsSync(resolve(root, file)));
  const findings = [];
  for (const file of files) findings.push(...(await lint(file, await readFile(resolve(root, file), 'utf8'), phrases)));
  return { files: files.length, findings };
}

async function main() {
  const { files, findings } = await lintFiles(process.argv.slice(2));
  for (const { path, line, found, use } of findings) {
    process.stdout.write(`${path}:${line}: "${found}"; better: ${use}\n`);
  }
  process.stdout.write(`${files} files, ${findings.length} findings\n`);
  if (findings.length > 0) process.exitCode = 1;
}

if (startedAs(import.meta.url)) await script(main);
