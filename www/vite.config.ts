import { readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { defineConfig, type Plugin, type Rolldown } from 'vite';
import { noteBundled } from '../scripts/licences.mjs';
import { APP_POLICY, EXTRACT_WORKER } from '../scripts/policy.mjs';
import { fewTexts } from './texts-of-workers';

/** A live page for each host that there is an adapter for. */
const EMBEDS = [
  'index',
  'three',
  'niivue',
  'niivue-next',
  'draw',
  'vtk',
  'vtk-labels',
  'itk',
  'cornerstone',
  'element',
];

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** Puts the built pages under their policy. While developing, Vite puts styles inline, which it forbids. */
function underPolicy(): Plugin {
  const attrs = { 'http-equiv': 'Content-Security-Policy', content: APP_POLICY };
  return {
    name: 'under-policy',
    apply: 'build',
    transformIndexHtml: () => [{ tag: 'meta', attrs, injectTo: 'head-prepend' }],
  };
}

/** Modules that decode compressed DICOM images, by package. */
const DECODERS = [
  ['codec-libjpeg-turbo-8bit', 'libjpegturbowasm_decode.wasm'],
  ['codec-charls', 'charlswasm_decode.wasm'],
  ['codec-openjpeg', 'openjpegwasm_decode.wasm'],
  ['codec-openjph', 'openjphjs.wasm'],
] as const;

/** Lays the modules that decode DICOM images beside the page, under the names that their loaders ask for. */
function decodersBeside(): Plugin {
  const read = (decoder: string, name: string) =>
    readFileSync(here(`../node_modules/@cornerstonejs/${decoder}/dist/${name}`));
  return {
    name: 'decoders-beside',
    generateBundle() {
      for (const [decoder, name] of DECODERS)
        this.emitFile({ type: 'asset', fileName: `dicom/${name}`, source: read(decoder, name) });
    },
    configureServer({ middlewares }) {
      middlewares.use('/dicom', (request, response, next) => {
        const [decoder, name] = DECODERS.find(([, name]) => request.url?.split('?')[0] === `/${name}`) ?? [];
        if (!decoder || !name) return next();
        response.setHeader('Content-Type', 'application/wasm');
        response.end(read(decoder, name));
      });
    },
  };
}

/** Gives the tools of Cornerstone the vtk.js of its core, an older one than ours: objects of two do not fit together. */
function sameVtk(): Plugin {
  const core = here('../node_modules/@cornerstonejs/core/dist/esm/index.js');
  return {
    name: 'same-vtk',
    enforce: 'pre',
    resolveId(id, importer) {
      if (!id.startsWith('@kitware/vtk.js') || !importer?.includes('@cornerstonejs/tools')) return undefined;
      return this.resolve(id, core, { skipSelf: true });
    },
  };
}

/**
 * Leaves out clipper2-ts, with which Cornerstone's tools combine contours, which our page does not do: its licence is not
 * one of those in deny.toml.
 */
function withoutClipper(): Plugin {
  const names = ['Clipper', 'ClipType', 'FillRule', 'PolyTreeD'];
  return {
    name: 'without-clipper',
    enforce: 'pre',
    resolveId: (id) => (id === 'clipper2-ts' ? '\0clipper2-ts' : undefined),
    load: (id) => (id === '\0clipper2-ts' ? names.map((name) => `export const ${name} = {};`).join('\n') : undefined),
  };
}

/** Chunks that one of `entries` leads to, these included. */
function reached(bundle: Rolldown.OutputBundle, entries: Rolldown.OutputChunk[]): Set<string> {
  const found = new Set(entries.map(({ fileName }) => fileName));
  for (const name of found) {
    const chunk = bundle[name];
    if (chunk?.type === 'chunk') for (const next of [...chunk.imports, ...chunk.dynamicImports]) found.add(next);
  }
  return found;
}

/** The whole library for engines without vector instructions, of which the labs need none offline. */
const PLAIN = /pkg\/vesicle_plain_bg\.wasm$/;

/** Names the built files of the app, for the service worker to keep: what the labs load, now or later. */
function listFiles(): Plugin {
  const isEmbed = ({ facadeModuleId }: Rolldown.OutputChunk) => facadeModuleId?.includes('/embed/') === true;
  return {
    name: 'list-files',
    apply: 'build',
    // Late: after Vite has removed the scripts that only represent styles.
    enforce: 'post',
    generateBundle(_, bundle) {
      const entries = Object.values(bundle)
        .filter((one) => one.type === 'chunk')
        .filter(({ isEntry }) => isEntry);
      const own = reached(
        bundle,
        entries.filter((one) => !isEmbed(one)),
      );
      const theirs = reached(bundle, entries.filter(isEmbed));
      const isPlain = (name: string) => {
        const file = bundle[name];
        return file?.type === 'asset' && file.originalFileNames.some((from) => PLAIN.test(from));
      };
      const wanted = (name: string) =>
        name.startsWith('assets/') && (own.has(name) || !theirs.has(name)) && !isPlain(name);
      const listed = Object.keys(bundle).filter(wanted).sort();
      this.emitFile({ type: 'asset', fileName: 'files.json', source: `${JSON.stringify(listed, null, 1)}\n` });
    },
  };
}

/** Leaves out the older formats of KaTeX's fonts: every browser that runs the app reads the first. */
function newestFonts(): Plugin {
  return {
    name: 'newest-fonts',
    enforce: 'pre',
    transform: (code, id) =>
      id.endsWith('katex.min.css') ? code.replace(/,url\([^)]+\.(woff|ttf)\) format\("\w+"\)/g, '') : undefined,
  };
}

/** Methods by the worker that runs them. */
const METHODS = new Map([
  [here('src/labs/extract/worker.ts'), 'deformable'],
  [here('src/labs/reconstruct/worker.ts'), 'implicit'],
  [here('src/labs/track/worker.ts'), 'tracking'],
  [here('src/labs/sculpt/worker.ts'), 'multires'],
]);

/**
 * Gives the worker of a lab with a method, for `vesicle`, the entry point with that method alone, whose module is
 * smaller. The Segment lab needs the whole library.
 */
function ownMethod(): Plugin {
  let method: string | undefined;
  return {
    name: 'own-method',
    enforce: 'pre',
    buildStart({ input }) {
      method = METHODS.get(Object.values(input).at(0) ?? '');
    },
    resolveId: (id) => (method && id === here('../pkg') ? here(`../pkg/${method}/index.js`) : undefined),
  };
}

/** The Extract lab's worker has a policy of its own, which servers choose by its name. */
const nameWorker = ({ facadeModuleId }: Rolldown.PreRenderedChunk) =>
  `assets/${facadeModuleId === here('src/labs/extract/worker.ts') ? EXTRACT_WORKER : '[name]'}-[hash].js`;

/** For the notices beside the page. */
const noted = noteBundled('app', [...DECODERS.map(([decoder]) => `@cornerstonejs/${decoder}`), 'draco3dgltf']);

export default defineConfig({
  root: here('.'),
  // Relative addresses: the built page works from any folder of any server.
  base: './',
  resolve: {
    alias: [
      { find: /^vesicle\/(three|niivue|vtk|cornerstone)$/, replacement: `${here('../pkg/adapters')}/$1.js` },
      { find: /^vesicle\/(import|zarr|dicom|gltf|tiff)$/, replacement: `${here('../pkg')}/$1/index.js` },
      { find: /^vesicle\/(\w+)$/, replacement: `${here('../pkg')}/$1.js` },
      { find: /^vesicle$/, replacement: here('../pkg') },
    ],
  },
  plugins: [underPolicy(), sameVtk(), withoutClipper(), newestFonts(), decodersBeside(), listFiles(), noted.page],
  worker: {
    format: 'es',
    plugins: () => [ownMethod(), fewTexts(), noted.worker],
    rolldownOptions: { output: { entryFileNames: nameWorker } },
  },
  server: { host: '127.0.0.1' },
  preview: { host: '127.0.0.1' },
  build: {
    outDir: here('../dist'),
    emptyOutDir: true,
    target: 'es2022',
    rolldownOptions: {
      input: ['index', 'bench', ...EMBEDS.map((name) => `embed/${name}`)].map((name) => here(`${name}.html`)),
    },
    // The policy allows no data: script or style; small files stay files.
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
