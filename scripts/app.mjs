// Builds the web app from www/ into dist/, and the documentation beside it; needs pkg/.
import { writeNotices } from './licences.mjs';
import { at, must, say, tool } from './shell.mjs';

/** Builds the app and its documentation into `dist/` as static files for any server. */
export async function buildApp() {
  const started = performance.now();
  const vite = ['build', '--logLevel', 'warn', '--config', at('www/vite.config.ts')];
  // For the test runner, which calls this, the mode is another one.
  await must(tool('vite'), vite, { env: { NODE_ENV: 'production' } });
  await writeNotices('dist/licences.txt', 'element', 'app');
  await must(tool('typedoc'), ['--options', at('typedoc.json'), '--logLevel', 'Warn']);
  say('dist', `${((performance.now() - started) / 1000).toFixed(1)} s`);
}
