// Sets up, builds the package and the app, and serves it on PORT; by default on 5173 or, if that is taken, any free
// port.
import { buildApp } from './app.mjs';
import { build } from './build.mjs';
import { serveApp } from './serve.mjs';
import { setup } from './setup.mjs';
import { at, say, script } from './shell.mjs';

async function listen() {
  const { PORT } = process.env;
  if (PORT) return serveApp(at('dist'), Number(PORT));
  return serveApp(at('dist'), 5173).catch(() => serveApp(at('dist'), 0));
}

await script(async () => {
  await setup({ browser: false });
  await build({ quick: true });
  await buildApp();
  const { address } = await listen();
  say('ready', address);
});
