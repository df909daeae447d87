// Reads every volume, mesh and point file of a folder, such as a clone of a repository with test files:
// `npm run corpora -- FOLDER... [--python PATH] [--seconds N] [--megabytes N]`. Files are read in a child process, which is
// ended and started again if a file takes too long, or too much memory. Prints a table by class, the reasons of refusals,
// and, with a Python that has nibabel, SimpleITK, pydicom, tifffile and trimesh, where other readers find something else.
// Ends with 1 if a file crashes the reader, or takes too long.
import { spawn } from 'node:child_process';
import { readdir } from 'node:fs/promises';
import { extname, join, relative } from 'node:path';
import { createInterface } from 'node:readline';
import { parseArgs } from 'node:util';
import { build } from './build.mjs';
import { at, say, script, startedAs } from './shell.mjs';

/** Classes of files by ending. */
const CLASSES = [
  ['volume', /\.(nii(\.gz)?|nrrd|nhdr|mha|mhd|hdr)$/i],
  ['mesh', /\.(stl|ply|obj|glb|gltf)$/i],
  ['points', /\.(xyz|pts|csv)$/i],
  ['tiff', /\.(tiff?)$/i],
  ['dicom', /\.(dcm|dicom|ima)$/i],
];

/** Largest relative difference of a sum from that of another reader. */
const SAME = 1e-3;

const classOf = (name) => CLASSES.find(([, ending]) => ending.test(name))?.[0];

/** Returns the files of known classes in a folder, with their paths. */
async function filesIn(folder) {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  const files = entries.filter((entry) => entry.isFile() && classOf(entry.name));
  return files.map((entry) => join(entry.parentPath, entry.name)).sort();
}

/** A program that answers each line with a line, and is started again when it ends or is too slow. */
class Reader {
  #command;
  #seconds;
  #child;
  #lines;

  constructor(command, seconds) {
    this.#command = command;
    this.#seconds = seconds;
  }

  /** Returns the answer to a request; or how the program failed. */
  async ask(request) {
    this.#start();
    this.#child.stdin.write(`${JSON.stringify(request)}\n`);
    const timer = setTimeout(() => this.#child.kill('SIGKILL'), 1000 * this.#seconds);
    const began = performance.now();
    const { value, done } = await this.#lines.next();
    clearTimeout(timer);
    const seconds = (performance.now() - began) / 1000;
    // Python writes NaN as it is.
    if (!done) return { ...JSON.parse(value.replace(/\bNaN\b|-?Infinity/g, 'null')), seconds };
    this.#child = undefined;
    return { status: seconds >= this.#seconds ? 'slow' : 'crash', reason: 'the process ended', seconds };
  }

  #start() {
    if (this.#child) return;
    const [command, ...args] = this.#command;
    this.#child = spawn(command, args, { stdio: ['pipe', 'pipe', 'ignore'] });
    this.#child.stdin.on('error', () => undefined);
    this.#lines = createInterface({ input: this.#child.stdout })[Symbol.asyncIterator]();
  }

  end() {
    this.#child?.stdin.end();
  }
}

/** Returns what another reader finds that differs; undefined if they agree. */
function difference(ours, theirs) {
  for (const [name, value] of Object.entries(theirs)) {
    const own = ours[name];
    if (own === undefined) continue;
    const isSame = Array.isArray(value)
      ? value.length === own.length && value.every((x, k) => near(x, own[k]))
      : near(value, own);
    if (!isSame) return `${name} ${JSON.stringify(own)}, there ${JSON.stringify(value)}`;
  }
  return undefined;
}

const near = (a, b) => Math.abs(a - b) <= SAME * Math.max(Math.abs(a), Math.abs(b)) + 1e-9;

async function compared(path, kind, found, other) {
  const theirs = await other.ask({ path, kind });
  if (found.status === 'read' && theirs.status === 'read') return difference(found.facts, theirs.facts);
  if (found.status === 'refused' && theirs.status === 'read') return 'refused here, read there';
  return undefined;
}

/** Reads the files of a folder; returns a row for each. */
async function rowsOf(folder, reader, other) {
  const rows = [];
  for (const path of await filesIn(folder)) {
    const kind = classOf(path);
    const found = await reader.ask({ path, kind });
    const differs = other && found.status !== 'slow' ? await compared(path, kind, found, other) : undefined;
    rows.push({ path: relative(folder, path), kind, ...found, differs });
  }
  return rows;
}

const STATES = ['read', 'warned', 'refused', 'crash', 'slow'];

function print(folder, rows) {
  say(folder, `${rows.length} files`);
  for (const [kind] of CLASSES) {
    const own = rows.filter((row) => row.kind === kind);
    if (own.length === 0) continue;
    const counts = STATES.map((state) => `${state} ${own.filter((row) => stateOf(row) === state).length}`);
    const slowest = Math.max(...own.map(({ seconds }) => seconds));
    say(`  ${kind}`, `${own.length}: ${counts.join(', ')}; slowest ${slowest.toFixed(1)} s`);
  }
  const named = (row) => `${row.path} (${extname(row.path).slice(1)})`;
  for (const row of rows.filter(({ status }) => ['crash', 'slow'].includes(status)))
    say('    !', `${named(row)}: ${row.status}, ${row.reason}`);
  for (const row of rows.filter(({ differs }) => differs))
    say('    ≠', `${row.path}: ${row.differs}${row.reason ? ` (${row.reason})` : ''}`);
  const reasons = new Map();
  for (const row of rows.filter(({ status }) => status === 'refused')) {
    const reason = row.reason.replace(/\d+/g, 'n');
    reasons.set(reason, [...(reasons.get(reason) ?? []), row]);
  }
  for (const group of reasons.values()) say('    –', `${group.length} × ${group[0].reason} (${group[0].path})`);
}

const stateOf = ({ status, warnings = 0 }) => (status === 'read' && warnings > 0 ? 'warned' : status);

if (startedAs(import.meta.url)) {
  await script(async () => {
    const { values, positionals } = parseArgs({
      allowPositionals: true,
      options: {
        python: { type: 'string' },
        seconds: { type: 'string', default: '60' },
        megabytes: { type: 'string', default: '2048' },
      },
    });
    if (positionals.length === 0)
      throw new Error('npm run corpora -- FOLDER... [--python PATH] [--seconds N] [--megabytes N]');
    await build({ plain: false });
    const memory = `--max-old-space-size=${values.megabytes}`;
    const reader = new Reader([process.execPath, memory, at('scripts/corpora-reader.mjs')], Number(values.seconds));
    const other = values.python && new Reader([values.python, at('scripts/corpora_reader.py')], Number(values.seconds));
    let failed = 0;
    try {
      for (const folder of positionals) {
        const rows = await rowsOf(folder, reader, other);
        print(folder, rows);
        failed += rows.filter(({ status }) => status === 'crash' || status === 'slow').length;
      }
    } finally {
      reader.end();
      other?.end();
    }
    if (failed > 0) throw new Error(`${failed} files crashed the reader, or took too long`);
  });
}
