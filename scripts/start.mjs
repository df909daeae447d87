// Sets up, builds the package and the app, and serves it on PORT; by default on 5173 or, if that is taken, any free
// port.
import { buildApp } from './app.mjs';
import { build } from './build.mjs';
import { serve } from './serve.mjs';
import { setup } from './setup.mjs';
import { at, say, script } from './shell.mjs';

async function listen() {
  const { PORT } = process.env;
  if (PORT) return serve(at('dist'), Number(PORT));
  return serve(at('dist'), 5173).catch(() => serve(at('dist'), 0));
}

await script(async () => {
  await setup({ browser: false });
  // The app needs vector instructions.
  await build({ plain: false });
  await buildApp();
  const { address } = await listen();
  say('ready', address);
});
