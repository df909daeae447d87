// A headless Chromium for the scripts.
import { chromium } from 'playwright-core';
import { findChromium } from './setup.mjs';

const ARGUMENTS = [
  // WebGL2 rendered in software, and no background requests.
  ...['--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-background-networking'],
];

/** Launches a browser, with further arguments if given; the caller closes it. Throws if none is installed. */
export async function launchChromium(...more) {
  const executablePath = findChromium();
  if (!executablePath) throw new Error('no Chromium or Chrome was found: install one, or set CHROMIUM_PATH');
  const sandbox = process.getuid?.() === 0 ? ['--no-sandbox'] : [];
  return chromium.launch({ executablePath, args: [...ARGUMENTS, ...sandbox, ...more] });
}
