// Looks up known vulnerabilities of everything in the lock files: of npm packages at the registry, of crates in the
// RustSec database. Fails where there are some, and where nobody answers, since nothing was audited then.
import { run, say, script, startedAs } from './shell.mjs';

/** Severities of npm that fail; lower ones are only counted. */
const SEVERE = ['high', 'critical'];

/** Returns the result of `npm audit --json` from what it printed. */
export function packagesAudited(output) {
  const report = reportIn(output);
  const counts = report?.metadata?.vulnerabilities;
  if (!counts) return { name: 'npm', state: 'missed', words: report?.message ?? 'the registry did not answer' };
  const isSevere = SEVERE.some((level) => counts[level] > 0);
  const severe = SEVERE.map((level) => `${counts[level]} ${level}`);
  const words = `vulnerabilities: ${counts.total}, of which ${severe.join(', ')}`;
  return { name: 'npm', state: isSevere ? 'found' : 'clean', words };
}

/** Returns the object that npm prints between its warnings. */
function reportIn(output) {
  try {
    return JSON.parse(output.match(/^\{$[\s\S]*^\}$/m)?.[0]);
  } catch {
    return undefined;
  }
}

/** Returns the result of `cargo deny check advisories` from its exit code and what it printed. */
export function cratesAudited(code, output) {
  if (code === 0) return { name: 'crates', state: 'clean', words: 'no advisory applies' };
  const found = output.match(/^error\[/gm)?.length ?? 0;
  if (found > 0) return { name: 'crates', state: 'found', words: `advisories that apply: ${found}` };
  const isMissing = /no such command/.test(output);
  const [, problem = 'cargo-deny failed'] = output.match(/\[ERROR\] (.*)/) ?? [];
  const words = isMissing ? '`cargo install cargo-deny --locked` brings what is needed' : problem.slice(0, 200);
  return { name: 'crates', state: 'missed', words };
}

/** Audits npm packages and crates; `output` of a result is what the tool printed. */
export async function audit() {
  // A machine's own settings may have switched npm's audits off.
  const packages = await run('npm', ['audit', '--audit', '--json'], { echo: false });
  const crates = await run('cargo', ['deny', '--workspace', 'check', 'advisories'], { echo: false });
  return [
    { ...packagesAudited(packages.output), output: packages.output },
    { ...cratesAudited(crates.code, crates.output), output: crates.output },
  ];
}

const SAID = { clean: 'audited', found: 'VULNERABLE', missed: 'NOT AUDITED' };

/** Returns a result in words. */
export const wordsOf = ({ state, words }) => `${SAID[state]}: ${words}`;

if (startedAs(import.meta.url)) {
  await script(async () => {
    const results = await audit();
    for (const one of results) {
      if (one.state === 'found') process.stdout.write(one.output);
      say(one.name, wordsOf(one));
    }
    if (results.some(({ state }) => state !== 'clean')) throw new Error('the audit has not passed');
  });
}
