// Installs everything that building and testing a fresh clone needs. Does nothing if nothing is missing.
import { existsSync, statSync } from 'node:fs';
import { at, must, run, say, script, startedAs } from './shell.mjs';

const TARGET = 'wasm32-unknown-unknown';
const OLDEST_NODE = [20, 19];
const CHROMIUMS = [
  '/usr/bin/chromium',
  '/usr/bin/chromium-browser',
  '/usr/bin/google-chrome',
  '/usr/bin/google-chrome-stable',
  '/Applications/Google Chrome.app/Contents/MacOS/Google Chrome',
  '/Applications/Chromium.app/Contents/MacOS/Chromium',
  'C:\\Program Files\\Google\\Chrome\\Application\\chrome.exe',
];

function checkNode() {
  const [major, minor] = process.versions.node.split('.').map(Number);
  const enough = major > OLDEST_NODE[0] || (major === OLDEST_NODE[0] && minor >= OLDEST_NODE[1]);
  if (!enough)
    throw new Error(`Node ${process.versions.node} is too old: install Node ${OLDEST_NODE.join('.')} or newer`);
  say('node', process.versions.node);
}

async function checkRust() {
  const { code, output } = await run('cargo', ['--version'], { echo: false });
  if (code === 127) throw new Error('cargo is missing: install Rust from https://rustup.rs and open a new shell');
  if (code !== 0) await installToolchain(output);
  else say('rust', output.trim().split('\n').at(-1));
}

// rust-toolchain.toml names a version; if automatic installs are off, cargo fails until it is installed.
async function installToolchain(problem) {
  const { code, output } = await run('rustup', ['toolchain', 'install', '--no-self-update'], { echo: false });
  if (code !== 0)
    throw new Error(`the toolchain of rust-toolchain.toml is missing and could not be installed\n${problem}${output}`);
  say('rust', 'toolchain installed');
}

// Checks the file itself: starting rustup would take longer than all the rest.
async function addTarget() {
  const sysroot = (await must('rustc', ['--print', 'sysroot'])).trim();
  if (existsSync(`${sysroot}/lib/rustlib/${TARGET}/lib`)) return say('wasm target', 'present');
  await must('rustup', ['target', 'add', TARGET]);
  say('wasm target', 'added');
}

async function installPackages() {
  const installed = at('node_modules', '.package-lock.json');
  const fresh = existsSync(installed) && statSync(installed).mtimeMs >= statSync(at('package-lock.json')).mtimeMs;
  if (fresh) return say('packages', 'present');
  await must('npm', ['ci', '--no-audit', '--no-fund']);
  say('packages', 'installed');
}

/** Returns the path of a Chromium or Chrome, or undefined. `CHROMIUM_PATH` wins. */
export function findChromium() {
  const named = process.env.CHROMIUM_PATH;
  return named ? named : CHROMIUMS.find((path) => existsSync(path));
}

async function findOrInstallChromium() {
  const found = findChromium() ?? (await installChromium());
  if (found && existsSync(found)) return say('chromium', found);
  say('chromium', 'missing: the browser tests will fail. Install Chromium or Chrome, or set CHROMIUM_PATH');
}

async function installChromium() {
  const debianRoot = existsSync('/usr/bin/apt-get') && process.getuid?.() === 0;
  if (!debianRoot) return undefined;
  const env = { DEBIAN_FRONTEND: 'noninteractive' };
  await run('apt-get', ['update', '-q'], { env, echo: false });
  await run('apt-get', ['install', '-q', '-y', '--no-install-recommends', 'chromium'], { env, echo: false });
  return findChromium();
}

/** Runs all parts of the set-up in order. Throws if something is missing that this script must not install. */
export async function setup({ browser = true } = {}) {
  checkNode();
  await checkRust();
  await addTarget();
  await installPackages();
  if (browser) await findOrInstallChromium();
}

if (startedAs(import.meta.url)) await script(setup);
