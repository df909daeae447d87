// Fuzzes the core: `npm run fuzz -- [seconds per target] [target…]`, by default all targets for 60 seconds each.
// Failing inputs go to fuzz/artifacts, new corpus inputs to fuzz/corpus; neither belongs into the repository.
import { existsSync } from 'node:fs';
import { mkdir, readdir, readFile } from 'node:fs/promises';
import { at, must, run, say, script } from './shell.mjs';

const NIGHTLY = '+nightly';
const SECONDS = 60;
/** Longest input in bytes. Longer inputs are slower and find no more. */
const LONGEST = 4096;

// The core has no unsafe code of its own that a sanitizer could check; the targets count memory themselves.
const BUILD = ['--sanitizer', 'none', '--codegen-units', '16'];

async function checkTools() {
  const nightly = await run('cargo', [NIGHTLY, '--version'], { echo: false });
  if (nightly.code !== 0)
    throw new Error('fuzzing needs a nightly Rust: `rustup toolchain install nightly --profile minimal`');
  const fuzz = await run('cargo', [NIGHTLY, 'fuzz', '--version'], { echo: false });
  if (fuzz.code !== 0) throw new Error('fuzzing needs cargo-fuzz: `cargo install cargo-fuzz --locked`');
  say('tools', `${nightly.output.trim()}, ${fuzz.output.trim()}`);
}

async function allTargets() {
  const manifest = await readFile(at('fuzz', 'Cargo.toml'), 'utf8');
  return [...manifest.matchAll(/^\[\[bin\]\]\nname = "(\w+)"/gm)].map(([, name]) => name);
}

/** Parses seconds and targets from the command line. */
async function asked(words) {
  const all = await allTargets();
  const seconds = /^\d+$/.test(words[0] ?? '') ? Number(words.shift()) : SECONDS;
  const unknown = words.filter((name) => !all.includes(name));
  if (unknown.length > 0) throw new Error(`no target is called ${unknown.join(', ')}; there are ${all.join(', ')}`);
  return { seconds, targets: words.length > 0 ? words : all };
}

const number = (output, pattern) => Number(output.match(pattern)?.[1] ?? 0);

/** Extracts figures from libFuzzer's output. */
export function figures(output) {
  const covered = [...output.matchAll(/cov: (\d+)/g)].map(([, count]) => Number(count));
  const seeds = number(output, /INITED cov: (\d+)/);
  return {
    executions: number(output, /stat::number_of_executed_units: (\d+)/),
    perSecond: number(output, /stat::average_exec_per_sec: +(\d+)/),
    covered: Math.max(0, ...covered),
    fresh: Math.max(0, ...covered) - seeds,
  };
}

const finds = async (target) => {
  const folder = at('fuzz', 'artifacts', target);
  return existsSync(folder) ? await readdir(folder) : [];
};

async function fuzz(target, seconds) {
  const before = await finds(target);
  const corpus = at('fuzz', 'corpus', target);
  await mkdir(corpus, { recursive: true });
  const limits = [`-max_total_time=${seconds}`, `-max_len=${LONGEST}`, '-timeout=30', '-rss_limit_mb=2048'];
  const folders = [corpus, at('fuzz', 'seeds', target)];
  const args = [NIGHTLY, 'fuzz', 'run', ...BUILD, target, ...folders, '--', ...limits, '-print_final_stats=1'];
  const { code, output } = await run('cargo', args, { echo: false });
  const found = (await finds(target)).filter((name) => !before.includes(name));
  const row = { target, ...figures(output), crashes: found.length };
  if (row.executions === 0) throw new Error(`${target} did not run\n${output}`);
  print(row);
  if (code !== 0) process.stdout.write(`${told(output)}\n`);
  return row;
}

/** Returns the lines of the output that describe the failure. */
const told = (output) =>
  output
    .split('\n')
    .filter((line) => /panicked|assertion|left:|right:|ERROR|Test unit written|Failing input/.test(line))
    .join('\n');

const print = ({ target, executions, perSecond, fresh, covered, crashes }) =>
  process.stdout.write(
    `${target.padEnd(18)}${[executions, perSecond, `+${fresh}`, covered, crashes].map((n) => String(n).padStart(12)).join('')}\n`,
  );

async function main() {
  const { seconds, targets } = await asked(process.argv.slice(2));
  await checkTools();
  await must('cargo', [NIGHTLY, 'fuzz', 'build', ...BUILD]);
  print({
    target: 'target',
    executions: 'executions',
    perSecond: 'per second',
    fresh: 'coverage',
    covered: 'of it',
    crashes: 'crashes',
  });
  const rows = [];
  for (const target of targets) rows.push(await fuzz(target, seconds));
  const sum = (key) => rows.reduce((total, row) => total + row[key], 0);
  say('sum', `${sum('executions')} executions, ${sum('crashes')} crashes`);
  if (sum('crashes') > 0) process.exitCode = 1;
}

await script(main);
