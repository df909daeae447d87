// Runs once, before all tests of the app.
import { existsSync } from 'node:fs';
import { buildApp } from '../../scripts/app.mjs';
import { at } from '../../scripts/shell.mjs';

/** Builds the app and its documentation if that has not been done; test files that run in parallel share the result. */
export async function setup(): Promise<void> {
  if (!existsSync(at('dist/index.html')) || !existsSync(at('dist/docs'))) await buildApp();
}
