// Runs every check. Continues after a failure; the last line is the total.
// `npm test -- build package` runs only the stages of these names. `npm run test:all` also runs what takes too long for
// every change, and records when it last ran, and on which commit. On a terminal all output is shown; otherwise only
// failures, with all output in `target/test-logs`.
import { existsSync } from 'node:fs';
import { mkdir, readFile, rm, writeFile } from 'node:fs/promises';
import { buildApp } from './app.mjs';
import { audit, wordsOf } from './audit.mjs';
import { build } from './build.mjs';
import { setup } from './setup.mjs';
import { at, must, run, say, tool } from './shell.mjs';

const LOGS = 'target/test-logs';
const WASM = ['--target', 'wasm32-unknown-unknown'];
const DENY = ['--', '-D', 'warnings'];

/** Record of the last run of all tests, which `npm test` prints. */
const RECORD = 'tests/all.json';

// A fresh clone is compiled once: without what cargo writes for the next time, in fewer pieces, and without line numbers
// of backtraces, it takes a quarter less.
const ONCE = { CARGO_INCREMENTAL: '0', CARGO_PROFILE_TEST_CODEGEN_UNITS: '4', CARGO_PROFILE_TEST_DEBUG: '0' };
if (process.env.CI) Object.assign(process.env, ONCE);

const EVERYTHING = '--all';

const echo = Boolean(process.stdout.isTTY);

/** Returns a stage that runs a command, which passes or fails as a whole. */
const check = (command, args, options) => async () => {
  const { code, output } = await run(command, args, { echo, ...options });
  return code === 0 ? { passed: 1, failed: 0, output } : { passed: 0, failed: 1, output };
};

/** Returns a stage that calls a function, which throws if it fails. */
const works = (work) => async () => {
  await work();
  return { passed: 1, failed: 0 };
};

/** Audits what is in the lock files. What could not be audited is not counted, but said at the end. */
async function auditAll() {
  const results = await audit();
  const inState = (wanted) => results.filter(({ state }) => state === wanted);
  return {
    passed: inState('clean').length,
    failed: inState('found').length,
    missed: inState('missed'),
    output: results.map((one) => `${one.name}: ${wordsOf(one)}\n${one.output}`).join('\n'),
  };
}

/** Sums the counts of all `test result:` lines, as cargo's harness and the wasm runner print them. */
export function countCargo(output) {
  const counts = { passed: 0, failed: 0 };
  for (const [, passed, failed] of output.matchAll(/test result: .*?(\d+) passed; (\d+) failed/g)) {
    counts.passed += Number(passed);
    counts.failed += Number(failed);
  }
  return counts;
}

const cargoTests = (args, options) => async () => {
  const { code, output } = await run('cargo', ['test', '--locked', '-p', 'vesicle', '--no-fail-fast', ...args], {
    ...{ echo, ...options },
  });
  return { output, ...atLeastOneFailed(code, countCargo(output)) };
};

/** Examples in the documentation are small: most of the time is that of compiling the library for them. */
const NO_DEBUG = { env: { CARGO_PROFILE_DEV_DEBUG: '0' } };

/** Arguments that leave out the tests with the tag `long`, or select them. */
const SHORT = '--tags-filter=!long';
const LONG_ONES = '--tags-filter=long';

/** Returns a stage that runs the tests of a folder which further arguments of the runner select. */
const vitest =
  (folder, ...selection) =>
  async () => {
    const report = at('target', `${[folder, ...selection].join('-').replaceAll(/[^\w-]+/g, '-')}.json`);
    await rm(report, { force: true });
    const config = at(folder, 'vitest.config.ts');
    const args = [
      ...['run', '--dir', at(folder), '--config', config],
      ...['--reporter=default', '--reporter=json', `--outputFile.json=${report}`],
      ...selection,
    ];
    const { code, output } = await run(tool('vitest'), args, { echo });
    if (!existsSync(report)) return { passed: 0, failed: 1, output };
    const { numPassedTests, numFailedTests } = JSON.parse(await readFile(report, 'utf8'));
    return { output, ...atLeastOneFailed(code, { passed: numPassedTests, failed: numFailedTests }) };
  };

// A run that does not compile, or crashes, fails without reporting how many tests did not run.
function atLeastOneFailed(code, { passed, failed }) {
  if (passed + failed === 0) return { passed: 0, failed: 1 };
  return { passed, failed: code === 0 ? failed : Math.max(failed, 1) };
}

/**
 * Stages by group and lane, each with its budget: the seconds that it may take in a fresh clone on two cores, beside the
 * other lane. A stage over its budget is said, but does not fail: machines of the same kind differ by a factor of two.
 * The lanes of a group run in parallel; groups, and the stages of a lane, one after the other.
 */
const GROUPS = [
  [
    [
      ['format', check('cargo', ['fmt', '--all', '--check']), 10],
      ['biome', check(tool('biome'), ['ci', '--colors=off']), 10],
      ['prose', check(process.execPath, [at('scripts/prose.mjs')]), 25],
      ['clippy', check('cargo', ['clippy', '--locked', '-p', 'vesicle', '--all-targets', ...DENY]), 100],
      ['clippy wasm', check('cargo', ['clippy', '--locked', '-p', 'vesicle-bindings', ...WASM, ...DENY]), 100],
      [
        'rust docs',
        check('cargo', ['doc', '--locked', '-p', 'vesicle', '--no-deps'], { env: { RUSTDOCFLAGS: '-D warnings' } }),
        20,
      ],
      // Shows the tests' measurements in the log.
      ['native', cargoTests(['--lib', '--', '--show-output']), 600],
      // Has one thread only.
      ['wasm', cargoTests(['--lib', ...WASM]), 400],
    ],
    [
      ['build', works(() => build({ plain: false })), 650],
      ['types', check(tool('tsc'), ['-p', at('tests/js')]), 20],
      ['publint', check(tool('publint'), ['run', '--strict', at('pkg')]), 10],
      ['package', vitest('tests/js', SHORT), 200],
      ['app types', check(tool('tsc'), ['--noEmit', '-p', at('www')]), 20],
      ['app build', works(buildApp), 25],
      ['app test types', check(tool('tsc'), ['--noEmit', '-p', at('tests/app')]), 15],
      ['app', vitest('tests/app', '--project=units', '--project=together', SHORT), 450],
    ],
  ],
  [[['app alone', vitest('tests/app', '--project=alone', SHORT), 100]]],
];

/** Filters of the core's ignored tests that write files, or need files that are not in the repository. */
const BY_HAND = ['::write_', 'elsewhere::'];

const skipping = (filters) => filters.flatMap((filter) => ['--skip', filter]);

/** Filters of tests that take minutes natively, and are not run in wasm. */
const ONLY_NATIVE = ['of_the_papers_size', 'a_head_phantom', 'nine_more_radii', 'valid_for_long', 'depth_three'];

/** Filters of tests with random input, which run with more of it. */
const RANDOM = ['fuzz::', 'random_'];

/** Stages that only `npm run test:all` runs: too long for every change. */
const LONG = [
  [
    [
      ['features', works(checkFeatures), 300],
      ['whole build', works(build), 500],
      ['package more', vitest('tests/js', LONG_ONES), 100],
      ['app long', vitest('tests/app', '--project=long'), 600],
      ['app more', vitest('tests/app', '--project=units', '--project=together', LONG_ONES), 900],
      // The runner runs ignored tests only with all others.
      [
        'slow wasm',
        cargoTests(['--lib', ...WASM, '--', '--include-ignored', ...skipping([...ONLY_NATIVE, ...BY_HAND])]),
        1200,
      ],
    ],
    [
      ['audit', auditAll, 60],
      ['doc tests', cargoTests(['--doc', '--profile', 'dev'], NO_DEBUG), 80],
      ['slow', cargoTests(['--lib', '--', '--ignored', '--show-output', ...skipping(BY_HAND)]), 800],
      ['more seeds', cargoTests(['--lib', '--', ...RANDOM, '--show-output'], { env: { FUZZ_TIMES: '8' } }), 1000],
    ],
  ],
  [[['app alone more', vitest('tests/app', '--project=alone', LONG_ONES), 100]]],
];

/** Checks that each feature of the bindings compiles alone. */
async function checkFeatures() {
  for (const feature of [
    '',
    'deformable',
    'implicit',
    'tracking',
    'multires',
    'import',
    'enrich',
    'labels',
    'sparse',
  ]) {
    const args = ['clippy', '--locked', '-p', 'vesicle-bindings', '--no-default-features', '--features', feature];
    await must('cargo', [...args, ...WASM, ...DENY]);
  }
}

async function attempt([name, work, budget]) {
  const started = performance.now();
  process.stdout.write(`\n── ${name}\n`);
  const { output = '', ...counts } = await work().catch((error) => {
    process.stderr.write(`${error.message}\n`);
    return { passed: 0, failed: 1 };
  });
  await writeFile(at(LOGS, `${name.replaceAll(' ', '-')}.log`), output);
  if (counts.failed && !echo) process.stdout.write(`\n── ${name}: failed\n${failuresIn(output)}\n`);
  const seconds = (performance.now() - started) / 1000;
  return { name, budget, seconds, ...counts, missed: counts.missed ?? [] };
}

/** Records that all tests have passed on the present commit. */
async function record(results) {
  const commit = (await must('git', ['rev-parse', 'HEAD'])).trim();
  const passed = results.reduce((total, one) => total + one.passed, 0);
  const date = new Date().toISOString().slice(0, 10);
  const missed = missedIn(results);
  const all = { date, commit, passed, ...(missed.length > 0 && { notAudited: missed }) };
  await writeFile(at(RECORD), `${JSON.stringify(all, null, 2)}\n`);
}

/** Returns the names of what could not be audited. */
const missedIn = (results) => results.flatMap(({ missed }) => missed.map(({ name }) => name));

async function sayWhenAllRan() {
  if (!existsSync(at(RECORD))) return say('test:all', 'never ran');
  const { date, commit, notAudited } = JSON.parse(await readFile(at(RECORD), 'utf8'));
  const { code, output } = await run('git', ['rev-list', '--count', `${commit}..HEAD`], { echo: false });
  const since = code === 0 ? `, ${output.trim()} commits ago` : '';
  const without = notAudited ? `, without an audit of ${notAudited.join(' and ')}` : '';
  say('test:all', `last passed on ${date} on ${commit.slice(0, 7)}${since}${without}`);
}

/**
 * Returns the part of a stage's output that explains the failure: lines that report failures with those after them, and
 * the end.
 */
function failuresIn(output) {
  const lines = output.split('\n');
  const tells = lines.map((line) => /FAIL|panicked|^failures:|^error|✗|×/.test(line));
  const near = (i) => i >= lines.length - 40 || tells.slice(Math.max(i - 12, 0), i + 1).includes(true);
  return lines
    .filter((_, i) => near(i))
    .slice(-400)
    .join('\n');
}

function checkNames(names) {
  const known = [...GROUPS, ...LONG].flat(2).map(([stage]) => stage);
  const unknown = names.filter((name) => !known.includes(name));
  if (unknown.length > 0) throw new Error(`no stage is called ${unknown}; there are ${known}`);
}

async function inTurn(stages) {
  const results = [];
  for (const stage of stages) results.push(await attempt(stage));
  return results;
}

async function all(names, groups) {
  checkNames(names);
  await mkdir(at(LOGS), { recursive: true });
  const ready = await attempt(['set-up', works(setup), 60]);
  // Without tools and packages no other stage can run.
  if (ready.failed) return [ready];
  const results = [ready];
  for (const lanes of groups) {
    const wanted = lanes.map((lane) => lane.filter(([stage]) => names.length === 0 || names.includes(stage)));
    results.push(...(await Promise.all(wanted.map(inTurn))).flat());
  }
  return results;
}

const given = process.argv.slice(2);
const names = given.filter((name) => name !== EVERYTHING);
const isLong = given.includes(EVERYTHING) || names.some((name) => LONG.flat(2).some(([stage]) => stage === name));
const results = await all(names, isLong ? [...GROUPS, ...LONG] : GROUPS);
const sum = (key) => results.reduce((total, result) => total + result[key], 0);
process.stdout.write('\n');
for (const { name, seconds, budget, passed, failed, missed } of results) {
  const counts = `${String(passed).padStart(5)} passed ${String(failed).padStart(4)} failed`;
  say(
    name,
    `${counts} ${seconds.toFixed(1).padStart(7)} s of ${String(budget).padStart(3)}${seconds > budget ? ', over' : ''}`,
  );
  for (const one of missed) say(name, `${one.name} ${wordsOf(one)}`);
}
if (given.includes(EVERYTHING) && sum('failed') === 0) await record(results);
await sayWhenAllRan();
process.stdout.write(`${sum('passed')} passed, ${sum('failed')} failed\n`);
process.exitCode = sum('failed') > 0 ? 1 : 0;
