// Helpers of the other scripts: paths, and running commands.
import { spawn } from 'node:child_process';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

/** The project's folder. */
export const root = dirname(dirname(fileURLToPath(import.meta.url)));

/** Returns the absolute path of a file or folder of the project. */
export const at = (...parts) => join(root, ...parts);

/** Returns the path of a program that `npm ci` installed. */
export const tool = (name) => at('node_modules', '.bin', process.platform === 'win32' ? `${name}.cmd` : name);

/** Prints one line of progress. */
export function say(what, detail = '') {
  process.stdout.write(`${what.padEnd(12)} ${detail}\n`);
}

/**
 * Returns the current environment plus `extra`, without progress bars, and without colours if the output is no
 * terminal.
 */
function environment(extra) {
  const plain = process.stdout.isTTY ? {} : { NO_COLOR: '1' };
  return { ...process.env, CARGO_TERM_PROGRESS_WHEN: 'never', ...plain, ...extra };
}

/**
 * Runs a command in the project's folder and resolves to `{ code, output }`, where output is everything it printed.
 * With `echo` the output is also printed immediately.
 */
export function run(command, args, { env = {}, echo = true, cwd = root } = {}) {
  return new Promise((resolve) => {
    const shell = process.platform === 'win32';
    const child = spawn(command, args, { cwd, env: environment(env), stdio: ['ignore', 'pipe', 'pipe'], shell });
    let output = '';
    const take = (stream) => (chunk) => {
      output += chunk;
      if (echo) stream.write(chunk);
    };
    child.stdout.on('data', take(process.stdout));
    child.stderr.on('data', take(process.stderr));
    child.on('error', (error) => resolve({ code: 127, output: `${command}: ${error.message}\n` }));
    child.on('close', (code) => resolve({ code: code ?? 1, output }));
  });
}

/** Like `run`, but throws with the output when the command fails. */
export async function must(command, args, options = {}) {
  const { code, output } = await run(command, args, { echo: false, ...options });
  if (code !== 0) throw new Error(`\`${command} ${args.join(' ')}\` ended with code ${code}\n${output}`);
  return output;
}

/** Runs a script's `main`, turning an exception into one message and exit code 1. */
export async function script(main) {
  try {
    await main();
  } catch (error) {
    process.stderr.write(`${error.message}\n`);
    process.exitCode = 1;
  }
}

/** Returns whether the file at `url` is the script that was started, and not imported. */
export const startedAs = (url) => process.argv[1] === fileURLToPath(url);
