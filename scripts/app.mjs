// Builds the web app from www/ into dist/; needs pkg/.
import { at, must, say, tool } from './shell.mjs';

/** The app as static files, ready for any server. */
export async function buildApp() {
  const started = performance.now();
  await must(tool('vite'), ['build', '--logLevel', 'warn', '--config', at('www/vite.config.ts')]);
  say('dist', `${((performance.now() - started) / 1000).toFixed(1)} s`);
}
