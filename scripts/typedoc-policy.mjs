// Plugin of typedoc: puts the documentation under its content security policy, which allows no inline scripts.
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { JSX, PageEvent } from 'typedoc';
import { DOCS_POLICY } from './policy.mjs';

const SCRIPT = 'assets/theme.js';

/** Called by typedoc. */
export function load({ renderer }) {
  const scripts = new Set();
  const meta = { 'http-equiv': 'Content-Security-Policy', content: DOCS_POLICY };
  renderer.hooks.on('head.begin', () => JSX.createElement('meta', meta));
  renderer.on(PageEvent.END, (page) => {
    page.contents = withoutInline(page.contents, scripts);
  });
  renderer.postRenderAsyncJobs.push(({ outputDirectory }) => writeScript(outputDirectory, scripts));
}

/** Replaces inline scripts, which are added to `scripts`, by one in a file. */
function withoutInline(html, scripts) {
  const [, base] = html.match(/ data-base="([^"]*)"/) ?? [];
  return html.replace(/<script>([^<]*)<\/script>/g, (_, script) => {
    scripts.add(script);
    return `<script src="${base}${SCRIPT}"></script>`;
  });
}

/** Writes the script that all pages have inline: the theme is set before anything is drawn. */
async function writeScript(folder, scripts) {
  if (scripts.size !== 1)
    throw new Error(`pages of the documentation have ${scripts.size} inline scripts, and not one`);
  await writeFile(join(folder, SCRIPT), [...scripts].join());
}
