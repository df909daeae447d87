import { fileURLToPath } from 'node:url';
import { defineConfig, type Plugin } from 'vite';

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

/** While developing, Vite puts styles inline, which the page's content-security policy forbids; the built page keeps the policy. */
function relaxPolicyWhileDeveloping(): Plugin {
  return {
    name: 'relax-policy-while-developing',
    apply: 'serve',
    transformIndexHtml: (html) => html.replace(/<meta\s+http-equiv="Content-Security-Policy"[^>]*>/, ''),
  };
}

/** Names every built file, for the service worker to keep. */
function listFiles(): Plugin {
  return {
    name: 'list-files',
    apply: 'build',
    generateBundle(_, bundle) {
      const names = Object.keys(bundle).filter((name) => name.startsWith('assets/'));
      this.emitFile({ type: 'asset', fileName: 'files.json', source: `${JSON.stringify(names.sort(), null, 1)}\n` });
    },
  };
}

export default defineConfig({
  root: here('.'),
  // Relative addresses: the built page works from any folder of any server.
  base: './',
  resolve: { alias: { vesicle: here('../pkg') } },
  plugins: [relaxPolicyWhileDeveloping(), listFiles()],
  worker: { format: 'es' },
  build: {
    outDir: here('../dist'),
    emptyOutDir: true,
    target: 'es2022',
    rolldownOptions: { input: [here('index.html'), here('bench.html')] },
    // The policy allows no data: script or style; small files stay files.
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1000,
  },
});
