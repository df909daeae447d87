// Writes the report of the public API of each entry point of the built package, `api/*.api.md`, which a test compares.
import { mkdir, rm } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { Extractor, ExtractorConfig } from '@microsoft/api-extractor';
import { at, say, script, startedAs } from './shell.mjs';

/** Folder of the reports that are in the repository. */
export const REPORTS = at('api');

const silent = { logLevel: 'none' };

/** Returns the entry points that have declarations of their own, with the files of these. */
export function entries() {
  const { exports } = createRequire(import.meta.url)(at('pkg/package.json'));
  const byFile = new Map();
  for (const [path, { types }] of Object.entries(exports)) if (types && !byFile.has(types)) byFile.set(types, path);
  return Array.from(byFile, ([types, path]) => ({ name: path.slice('./'.length) || 'index', types: at('pkg', types) }));
}

/** Writes the report of an entry point into a folder. */
export function report({ name, types }, folder) {
  const config = ExtractorConfig.prepare({
    configObject: {
      projectFolder: at('pkg'),
      mainEntryPointFilePath: types,
      compiler: { overrideTsconfig: { extends: at('js/tsconfig.json'), files: [types] } },
      apiReport: {
        enabled: true,
        reportFileName: `${name}.api.md`,
        reportFolder: folder,
        reportTempFolder: at('target/api'),
      },
      docModel: { enabled: false },
      dtsRollup: { enabled: false },
      tsdocMetadata: { enabled: false },
      messages: {
        compilerMessageReporting: { default: silent },
        extractorMessageReporting: { default: silent },
        tsdocMessageReporting: { default: silent },
      },
    },
    configObjectFullPath: undefined,
    packageJsonFullPath: at('pkg/package.json'),
  });
  Extractor.invoke(config, { localBuild: true, messageCallback: (message) => (message.handled = true) });
}

if (startedAs(import.meta.url)) {
  await script(async () => {
    await rm(REPORTS, { recursive: true, force: true });
    await mkdir(REPORTS);
    for (const entry of entries()) report(entry, REPORTS);
    say('api', REPORTS);
  });
}
